// The cache directory: what is in it after restarts, faults and interference, and that whatever
// comes out of it is right.

#include "server/particle_files.h"

#include <filesystem>
#include <fstream>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include <sys/resource.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "halflight/sha256.h"
#include "server/error_detail.h"
#include "server/particle_store.h"
#include "server/particle_upload.h"
#include "server/status_text.h"
#include "tests/process/process.h"
#include "tests/process/small_disk.h"
#include "tests/process/wait_for.h"
#include "tests/sanitizers.h"
#include "tests/server/made_particles.h"
#include "tests/server/on_disk.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;
using testing::Contents;
using ::testing::HasSubstr;
using testing::MakeParticles;
using testing::OnDiskAlone;
using testing::WaitFor;

// Sets of different contents with every attribute.
NamedParticles SetOf(int particles) {
  v1::InlineParticles inlined =
      MakeParticles(particles, {v1::PARTICLE_ATTRIBUTE_POSITION, v1::PARTICLE_ATTRIBUTE_RADIUS,
                                v1::PARTICLE_ATTRIBUTE_OPACITY, v1::PARTICLE_ATTRIBUTE_COLOR,
                                v1::PARTICLE_ATTRIBUTE_VELOCITY, v1::PARTICLE_ATTRIBUTE_EMISSION});
  inlined.mutable_layout()->mutable_origin()->set_x(-0.0);
  inlined.mutable_layout()->mutable_origin()->set_z(1e7 + 0.1);
  return *BuildInlineParticles(inlined, {});
}

constexpr uint64_t kBytesEach = 56;  // a particle, of a set of these

class Files : public ::testing::Test {
 protected:
  std::unique_ptr<ParticleFiles> Open() {
    auto files = ParticleFiles::Open(path_, limits_);
    EXPECT_TRUE(files.ok()) << files.status();
    return files.ok() ? *std::move(files) : nullptr;
  }

  [[nodiscard]] std::string PathOf(const std::string& sha256) const {
    return path_ + "/" + ToHex(sha256) + ".particles";
  }

  static void Write(ParticleFiles& files, const NamedParticles& particles) {
    files.Write(particles.sha256, particles.set);
    ASSERT_TRUE(WaitFor([&] { return files.idle(); }));
  }

  static absl::StatusOr<std::shared_ptr<const ParticleSet>> TryRead(
      ParticleFiles& files, const std::string& sha256, const std::stop_token& stop = {}) {
    std::promise<absl::StatusOr<std::shared_ptr<const ParticleSet>>> read;
    files.Read(sha256, stop, [&read](const auto& set) { read.set_value(set); });
    return read.get_future().get();
  }
  static std::shared_ptr<const ParticleSet> Read(ParticleFiles& files, const std::string& sha256,
                                                 const std::stop_token& stop = {}) {
    const auto set = TryRead(files, sha256, stop);
    EXPECT_TRUE(set.ok()) << set.status();
    return set.value_or(nullptr);
  }

  static void ExpectSame(const std::shared_ptr<const ParticleSet>& set,
                         const NamedParticles& particles) {
    ASSERT_NE(set, nullptr);
    EXPECT_EQ(set->origin, particles.set->origin);
    EXPECT_EQ(set->positions, particles.set->positions);
    EXPECT_EQ(set->radii, particles.set->radii);
    EXPECT_EQ(set->opacities, particles.set->opacities);
    EXPECT_EQ(set->colors, particles.set->colors);
    EXPECT_EQ(set->velocities, particles.set->velocities);
    EXPECT_EQ(set->emissions, particles.set->emissions);
  }

  const testing::Folder folder_;
  std::string path_ = folder_ / "cache";
  ServerLimits limits_;
};

TEST_F(Files, SetsOutlastTheServerAndAFileIsWhatTheNameCovers) {
  const NamedParticles one = SetOf(100);
  const NamedParticles two = SetOf(7);
  {
    const auto files = Open();
    Write(*files, one);
    Write(*files, two);
    EXPECT_TRUE(files->Use(one.sha256));
  }
  EXPECT_EQ(Sha256Of(Contents(PathOf(one.sha256))), one.sha256);
  EXPECT_EQ(fs::file_size(PathOf(two.sha256)), 40 + 7 * kBytesEach);
  const auto files = Open();
  EXPECT_TRUE(files->Use(one.sha256));
  EXPECT_FALSE(files->Use(SetOf(3).sha256));
  ExpectSame(Read(*files, one.sha256), one);
  ExpectSame(Read(*files, two.sha256), two);
  EXPECT_EQ(Read(*files, SetOf(3).sha256), nullptr);
}

TEST_F(Files, SetsThatWaitAreWrittenBeforeItEnds) {
  std::vector<NamedParticles> sets;
  {
    const auto files = Open();
    for (int i = 1; i <= 30; ++i) {
      sets.push_back(SetOf(i));
      files->Write(sets.back().sha256, sets.back().set);
    }
  }
  const auto files = Open();
  for (const NamedParticles& set : sets) {
    EXPECT_TRUE(files->Use(set.sha256));
  }
}

TEST_F(Files, TheLeastRecentlyUsedGoFirstAlsoAfterARestart) {
  limits_.max_cache_dir_bytes = 3 * 4096;
  const NamedParticles sets[] = {SetOf(1), SetOf(2), SetOf(3), SetOf(4), SetOf(5)};
  {
    const auto files = Open();
    Write(*files, sets[0]);
    Write(*files, sets[1]);
    Write(*files, sets[2]);
    EXPECT_TRUE(files->Use(sets[0].sha256));
    Write(*files, sets[3]);
    EXPECT_FALSE(files->Use(sets[1].sha256));
    EXPECT_FALSE(fs::exists(PathOf(sets[1].sha256)));
    EXPECT_TRUE(files->Use(sets[2].sha256));  // now 2, 3, 0 from the last used on
  }
  const auto files = Open();
  Write(*files, sets[4]);
  EXPECT_FALSE(files->Use(sets[0].sha256));
  EXPECT_TRUE(files->Use(sets[3].sha256));
  EXPECT_TRUE(files->Use(sets[2].sha256));
  EXPECT_EQ(files->bytes(), 3U * 4096);
}

TEST_F(Files, SmallerBoundRemovesTheOldestAtStart) {
  const NamedParticles sets[] = {SetOf(1), SetOf(2), SetOf(3)};
  {
    const auto files = Open();
    for (const NamedParticles& set : sets) {
      Write(*files, set);
    }
  }
  limits_.max_cache_dir_bytes = 4096;
  const auto files = Open();
  EXPECT_FALSE(files->Use(sets[0].sha256));
  EXPECT_FALSE(files->Use(sets[1].sha256));
  ExpectSame(Read(*files, sets[2].sha256), sets[2]);
  EXPECT_FALSE(fs::exists(PathOf(sets[0].sha256)));
}

TEST_F(Files, SetLargerThanTheDirectoryMayBeIsNotWritten) {
  limits_.max_cache_dir_bytes = 8192;
  const auto files = Open();
  const NamedParticles small = SetOf(1);
  const NamedParticles large = SetOf(1000);
  Write(*files, small);
  Write(*files, large);
  EXPECT_FALSE(files->Use(large.sha256));
  EXPECT_TRUE(files->Use(small.sha256));
}

TEST_F(Files, NameThatLooksLikeAPathStaysInTheDirectory) {
  const std::string name = "../../../../../../../tmp/escaped";
  ASSERT_EQ(name.size(), kSha256Bytes);
  const auto files = Open();
  EXPECT_FALSE(files->Use(name));
  Write(*files, {name, SetOf(1).set});
  EXPECT_TRUE(fs::exists(PathOf(name)));
  EXPECT_EQ(Read(*files, name), nullptr) << "it is not what its name says";
}

TEST_F(Files, EmptySetIsNotWritten) {
  const auto files = Open();
  const NamedParticles empty = SetOf(0);
  Write(*files, empty);
  EXPECT_FALSE(files->Use(empty.sha256));
  EXPECT_EQ(files->bytes(), 0U);
}

TEST_F(Files, DamagedFilesAreMissingSetsAndAreRemoved) {
  const NamedParticles particles = SetOf(100);
  std::string whole;
  {
    const auto files = Open();
    Write(*files, particles);
    whole = Contents(PathOf(particles.sha256));
  }
  ASSERT_EQ(whole.size(), 40 + 100 * kBytesEach);
  std::vector<std::string> damaged = {"",
                                      whole.substr(0, 39),
                                      whole.substr(0, 40),
                                      whole.substr(0, whole.size() - 1),
                                      whole + "x",
                                      std::string(whole.size(), '\0')};
  // A bit in each field of the prefix and somewhere in each array.
  for (size_t at = 0; at < whole.size(); at += at < 40 ? 3 : 97) {
    damaged.push_back(whole);
    damaged.back()[at] = static_cast<char>(damaged.back()[at] ^ (1 << (at % 8)));
  }
  for (size_t i = 0; i < damaged.size(); ++i) {
    std::ofstream(PathOf(particles.sha256), std::ios::binary) << damaged[i];
    const auto files = Open();
    EXPECT_TRUE(files->Use(particles.sha256)) << "only reading tells";
    EXPECT_EQ(Read(*files, particles.sha256), nullptr) << i;
    EXPECT_FALSE(files->Use(particles.sha256)) << i;
    EXPECT_TRUE(WaitFor([&] { return !fs::exists(PathOf(particles.sha256)); })) << i;
    Write(*files, particles);
    ExpectSame(Read(*files, particles.sha256), particles);
  }
}

TEST_F(Files, FileOfMoreThanTheLimitsAllowIsAMissingSet) {
  const NamedParticles particles = SetOf(100);
  { Write(*Open(), particles); }
  limits_.max_particles = 99;
  const auto files = Open();
  EXPECT_EQ(Read(*files, particles.sha256), nullptr);
}

TEST_F(Files, RightSetUnderAWrongNameIsAMissingSet) {
  const NamedParticles one = SetOf(100);
  const NamedParticles two = SetOf(101);
  { Write(*Open(), one); }
  fs::rename(PathOf(one.sha256), PathOf(two.sha256));
  const auto files = Open();
  EXPECT_EQ(Read(*files, two.sha256), nullptr);
}

TEST_F(Files, WhatAKilledServerLeftIsRemovedAndForeignThingsAreLeftAlone) {
  fs::create_directory(path_);
  const std::string hex(64, 'a');
  const auto put = [this](const std::string& name) {
    std::ofstream(path_ + "/" + name) << "precious";
  };
  const std::vector<std::string> foreign = {"notes.txt",
                                            hex,
                                            hex + ".particles.old",
                                            std::string(64, 'A') + ".particles",
                                            std::string(63, 'a') + ".particles",
                                            ".particles",
                                            "x" + hex + ".particles"};
  for (const std::string& name : foreign) {
    put(name);
  }
  put(hex + ".particles.writing");
  fs::create_directory(path_ + "/" + std::string(64, 'b') + ".particles");
  fs::create_symlink("/etc/passwd", path_ + "/" + std::string(64, 'c') + ".particles");
  limits_.max_cache_dir_bytes = 4096;  // nor do they make room
  const auto files = Open();
  Write(*files, SetOf(1));
  Write(*files, SetOf(2));
  for (const std::string& name : foreign) {
    EXPECT_EQ(Contents(path_ + "/" + name), "precious") << name;
  }
  EXPECT_FALSE(fs::exists(path_ + "/" + hex + ".particles.writing"));
  EXPECT_TRUE(fs::exists(path_ + "/" + std::string(64, 'b') + ".particles"));
  EXPECT_TRUE(fs::is_symlink(path_ + "/" + std::string(64, 'c') + ".particles"));
  EXPECT_FALSE(files->Use(std::string(32, '\xcc')));
}

TEST_F(Files, OneServerADirectory) {
  auto first = Open();
  const auto second = ParticleFiles::Open(path_, limits_);
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(std::string(second.status().message()),
              HasSubstr(path_ + ": another server uses it"));
  first.reset();
  EXPECT_NE(Open(), nullptr);
}

TEST_F(Files, DirectoryThatCannotBeUsedIsNamed) {
  const auto message = [this](const std::string& path) {
    return MessageOf(ParticleFiles::Open(path, limits_).status());
  };
  EXPECT_THAT(message(folder_ / "no/such/parent"), HasSubstr("no/such/parent: cannot be made"));
  EXPECT_THAT(message(folder_.Write("file", "x")), HasSubstr("file: cannot be opened"));
  EXPECT_THAT(message(""), HasSubstr("cannot be made"));
}

TEST_F(Files, DirectoryWithoutPermissionIsNamed) {
  if (geteuid() != 0) {
    GTEST_SKIP() << "needs to be root, to become somebody else";
  }
  fs::create_directory(path_);
  constexpr fs::perms kReadable = fs::perms::owner_all | fs::perms::group_read |
                                  fs::perms::group_exec | fs::perms::others_read |
                                  fs::perms::others_exec;
  fs::permissions(path_, kReadable);
  fs::permissions(folder_.path(), kReadable);
  ASSERT_EQ(seteuid(65534), 0);
  const auto refused = ParticleFiles::Open(path_, limits_);
  ASSERT_EQ(seteuid(0), 0);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(std::string(refused.status().message()),
              HasSubstr(path_ + ": halflightd.lock in it cannot be opened: Permission denied"));
}

TEST_F(Files, DirectoryThatVanishesCostsItsSetsOnly) {
  const auto files = Open();
  const NamedParticles particles = SetOf(10);
  Write(*files, particles);
  fs::remove_all(path_);
  EXPECT_EQ(Read(*files, particles.sha256), nullptr);
  EXPECT_FALSE(files->Use(particles.sha256));
  Write(*files, particles);
  EXPECT_FALSE(files->Use(particles.sha256));
}

TEST_F(Files, ReadThatIsCancelledReadsNothingUnlessSomebodyElseWaits) {
  const auto files = Open();
  const NamedParticles particles = SetOf(10);
  Write(*files, particles);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(Read(*files, particles.sha256, stop.get_token()), nullptr);
  EXPECT_TRUE(files->Use(particles.sha256)) << "cancelled is not damaged";
  ExpectSame(Read(*files, particles.sha256), particles);
}

TEST_F(Files, WantOfDescriptorsCostsNoSet) {
  if (testing::kSanitized) GTEST_SKIP() << "UBSan takes objects for none without descriptors";
  const auto files = Open();
  const NamedParticles particles = SetOf(10);
  Write(*files, particles);
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  const rlimit none{.rlim_cur = 3, .rlim_max = limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const auto refused = TryRead(*files, particles.sha256);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(DetailOf(refused.status()).reason, v1::ERROR_REASON_CACHE_NOT_READ);
  EXPECT_TRUE(DetailOf(refused.status()).retry_after.has_value());
  ExpectSame(Read(*files, particles.sha256), particles);
}

TEST_F(Files, ManyThreadsAtOnceGetTheRightSetOrNone) {
  limits_.max_cache_dir_bytes = 5 * 4096;
  const auto files = Open();
  std::vector<NamedParticles> sets;
  for (int i = 1; i <= 12; ++i) {
    sets.push_back(SetOf(i));
  }
  std::vector<std::jthread> threads;
  for (size_t t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (size_t i = 0; i < 200; ++i) {
        const NamedParticles& particles = sets[(i * (t + 1)) % sets.size()];
        files->Write(particles.sha256, particles.set);
        const auto set = Read(*files, particles.sha256);
        EXPECT_TRUE(set == nullptr || set->positions == particles.set->positions);
      }
    });
  }
  threads.clear();
  ASSERT_TRUE(WaitFor([&] { return files->idle(); }));
  EXPECT_LE(files->bytes(), 5U * 4096);
  EXPECT_GT(files->bytes(), 0U);
}

TEST_F(Files, FullDiskCostsTheOldestSetsOrTheNewOneAndNothingElse) {
  const testing::SmallDisk disk(path_, "256k");
  if (!disk.mounted()) {
    GTEST_SKIP() << "no file system may be mounted here";
  }
  const auto files = Open();
  const NamedParticles small = SetOf(1000);   // 56 KB
  const NamedParticles medium = SetOf(3000);  // 168 KB
  const NamedParticles large = SetOf(10000);  // 560 KB, more than the disk
  Write(*files, small);
  Write(*files, medium);
  EXPECT_TRUE(files->Use(small.sha256));
  EXPECT_TRUE(files->Use(medium.sha256));

  const NamedParticles other = SetOf(3001);
  Write(*files, other);
  EXPECT_TRUE(files->Use(other.sha256)) << "the oldest make room";
  EXPECT_FALSE(files->Use(small.sha256));
  ExpectSame(Read(*files, other.sha256), other);

  Write(*files, large);
  EXPECT_FALSE(files->Use(large.sha256));
  EXPECT_FALSE(fs::exists(PathOf(large.sha256)));
  EXPECT_EQ(Read(*files, large.sha256), nullptr);

  // Filled by somebody else, then free again.
  std::ofstream(path_ + "/foreign") << std::string(1 << 20, 'x');
  Write(*files, medium);
  EXPECT_FALSE(files->Use(medium.sha256));
  fs::remove(path_ + "/foreign");
  Write(*files, medium);
  ExpectSame(Read(*files, medium.sha256), medium);
  for (const auto& entry : fs::directory_iterator(path_)) {
    EXPECT_THAT(entry.path().string(), ::testing::Not(::testing::EndsWith(".writing")));
  }
}

class StoreOnDisk : public Files {
 protected:
  // What Find gives after Fetch.
  static std::shared_ptr<const ParticleSet> Fetch(ParticleStore& store, const std::string& sha256) {
    std::promise<void> fetched;
    store.Fetch(sha256, {}, [&fetched](const absl::Status& status) {
      EXPECT_TRUE(status.ok()) << status;
      fetched.set_value();
    });
    fetched.get_future().wait();
    return store.Find(sha256);
  }
};

TEST_F(StoreOnDisk, SetDroppedFromMemoryComesBackFromDisk) {
  ParticleStore store(150 * kBytesEach, Open());
  const NamedParticles one = SetOf(100);
  const NamedParticles two = SetOf(101);
  EXPECT_TRUE(store.Insert(one.sha256, SetOf(100).set).ok());
  EXPECT_FALSE(OnDiskAlone(store, one.sha256));
  ASSERT_TRUE(WaitFor([&] { return store.Insert(two.sha256, SetOf(101).set).ok(); }));
  ASSERT_TRUE(WaitFor([&] { return store.idle(); }));
  EXPECT_EQ(store.Find(one.sha256), nullptr);
  EXPECT_TRUE(store.Touch(one.sha256));
  EXPECT_TRUE(OnDiskAlone(store, one.sha256));
  ExpectSame(Fetch(store, one.sha256), one);
  EXPECT_FALSE(OnDiskAlone(store, one.sha256));
  EXPECT_TRUE(OnDiskAlone(store, two.sha256));
  EXPECT_EQ(store.state().disk_reads, 1U);
  ExpectSame(Fetch(store, one.sha256), one);
  EXPECT_EQ(store.state().disk_reads, 1U) << "it is in memory";
  EXPECT_EQ(store.state().misses, 0U);
}

TEST_F(StoreOnDisk, SetsThatWaitForTheDiskAreNotDropped) {
  std::vector<NamedParticles> sets;
  ParticleStore store(50 * kBytesEach, Open());
  for (int i = 20; i < 40; ++i) {
    sets.push_back(SetOf(i));
    // There is room once others were written.
    ASSERT_TRUE(WaitFor([&] { return store.Insert(sets.back().sha256, SetOf(i).set).ok(); }));
    ASSERT_LE(store.bytes(), 50 * kBytesEach);
  }
  ASSERT_TRUE(WaitFor([&] { return store.idle(); }));
  for (const NamedParticles& set : sets) {
    ExpectSame(Fetch(store, set.sha256), set);
  }
}

TEST_F(StoreOnDisk, SetInUseKeepsItsRoomFromThoseOnDisk) {
  ParticleStore store(150 * kBytesEach, Open());
  const NamedParticles one = SetOf(100);
  const NamedParticles two = SetOf(101);
  EXPECT_TRUE(store.Insert(two.sha256, SetOf(101).set).ok());
  ASSERT_TRUE(WaitFor([&] { return store.idle(); }));
  EXPECT_TRUE(store.Insert(one.sha256, SetOf(100).set).ok());
  auto rendering = store.Find(one.sha256);
  std::promise<absl::Status> fetched;
  store.Fetch(two.sha256, {}, [&](const absl::Status& status) { fetched.set_value(status); });
  EXPECT_EQ(fetched.get_future().get().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(store.Find(two.sha256), nullptr);
  ExpectSame(rendering, one);
  ASSERT_TRUE(WaitFor([&] { return store.idle(); }));
  rendering.reset();
  ExpectSame(Fetch(store, two.sha256), two);
}

// Else its clients would be told for ever that it is here, and to come back.
TEST_F(StoreOnDisk, FileThatCanNeverBeTakenIsAMissingSetHoweverLittleRoomThereIs) {
  const NamedParticles set = SetOf(7);
  for (const std::string& bytes : {std::string(), std::string(1 << 20, 'x')}) {
    fs::create_directory(path_);
    std::ofstream(PathOf(set.sha256)) << bytes;
    ParticleStore store(150 * kBytesEach, Open());
    const NamedParticles one = SetOf(100);
    EXPECT_TRUE(store.Insert(one.sha256, one.set).ok()) << "and it stays in use";
    ASSERT_TRUE(OnDiskAlone(store, set.sha256));
    EXPECT_EQ(Fetch(store, set.sha256), nullptr);
    EXPECT_FALSE(store.Touch(set.sha256));
  }
}

TEST_F(StoreOnDisk, UseInMemoryKeepsTheFile) {
  limits_.max_cache_dir_bytes = 2 * 4096;
  ParticleStore store(1 << 20, Open());
  const NamedParticles sets[] = {SetOf(1), SetOf(2), SetOf(3)};
  for (int i : {0, 1}) {
    EXPECT_TRUE(store.Insert(sets[i].sha256, sets[i].set).ok());
  }
  ASSERT_TRUE(WaitFor([&] { return store.idle(); }));
  EXPECT_NE(store.Find(sets[0].sha256), nullptr);
  EXPECT_TRUE(store.Insert(sets[2].sha256, sets[2].set).ok());
  ASSERT_TRUE(WaitFor([&] { return store.idle(); }));
  EXPECT_TRUE(fs::exists(PathOf(sets[0].sha256)));
  EXPECT_FALSE(fs::exists(PathOf(sets[1].sha256)));
}

}  // namespace
}  // namespace halflight
