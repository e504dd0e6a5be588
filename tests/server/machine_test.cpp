// Who counts as one machine, whatever it calls itself.
#include "server/machine.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/un.h>

#include <gtest/gtest.h>

namespace halflight {
namespace {

std::string OfSocket(const char* address) {
  sockaddr_storage storage{};
  auto& v4 = reinterpret_cast<sockaddr_in&>(storage);
  auto& v6 = reinterpret_cast<sockaddr_in6&>(storage);
  if (inet_pton(AF_INET, address, &v4.sin_addr) == 1) {
    storage.ss_family = AF_INET;
  } else {
    EXPECT_EQ(inet_pton(AF_INET6, address, &v6.sin6_addr), 1) << address;
    storage.ss_family = AF_INET6;
  }
  return MachineOf(reinterpret_cast<const sockaddr&>(storage));
}

TEST(Machine, IsThatOfTheAddressWhateverThePort) {
  EXPECT_EQ(MachineOf("ipv4:10.1.2.3:40000"), "10.1.2.3");
  EXPECT_EQ(MachineOf("ipv4:10.1.2.3:40001"), OfSocket("10.1.2.3"));
  EXPECT_NE(MachineOf("ipv4:10.1.2.3:40000"), MachineOf("ipv4:10.1.2.4:40000"));
}

TEST(Machine, HasAnIpv6NetworkToItself) {
  EXPECT_EQ(MachineOf("ipv6:%5B2001:db8:1:2:3:4:5:6%5D:40000"), "2001:db8:1:2::/64");
  EXPECT_EQ(MachineOf("ipv6:[2001:db8:1:2:ffff::1]:40000"), OfSocket("2001:db8:1:2::7"));
  EXPECT_EQ(MachineOf("ipv6:%5Bfe80::1%25eth0%5D:40000"), OfSocket("fe80::2"));
  EXPECT_NE(OfSocket("2001:db8:1:2::1"), OfSocket("2001:db8:1:3::1"));
  EXPECT_EQ(MachineOf("ipv6:%5B::ffff:10.1.2.3%5D:40000"), "10.1.2.3");
  EXPECT_EQ(OfSocket("::ffff:10.1.2.3"), "10.1.2.3");
}

TEST(Machine, IsThisOneWhateverASocketHereIsCalled) {
  const std::string here = MachineOf("unix:");
  for (const char* peer :
       {"unix:/tmp/any", "unix-abstract:name", "ipv4:127.0.0.1:1", "ipv4:127.99.0.7:1",
        "ipv6:%5B::1%5D:1", "ipv6:%5B::ffff:127.0.0.2%5D:1", ""}) {
    EXPECT_EQ(MachineOf(peer), here) << peer;
  }
  for (const char* address : {"127.0.0.1", "127.99.0.7", "::1", "::ffff:127.0.0.2"}) {
    EXPECT_EQ(OfSocket(address), here) << address;
  }
  sockaddr_un local{};
  local.sun_family = AF_UNIX;
  EXPECT_EQ(MachineOf(reinterpret_cast<const sockaddr&>(local)), here);
}

}  // namespace
}  // namespace halflight
