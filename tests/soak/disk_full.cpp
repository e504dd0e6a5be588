// A cache directory on a disk that is full: sets are refused a file, never given a wrong one.

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <vector>

#include "client/client.h"
#include "halflight/sha256.h"
#include "tests/access/health.h"
#include "tests/process/small_disk.h"
#include "tests/process/wait_for.h"
#include "tests/soak/cache_dir.h"
#include "tests/soak/scenario.h"
#include "tests/soak/scene.h"
#include "tests/soak/server.h"

namespace halflight::soak {
namespace {

namespace fs = std::filesystem;

constexpr char kNotWritten[] = " cache_dir_not_written ";

// Files named like sets that are not those sets.
size_t DamagedFiles(const std::string& cache, size_t& whole) {
  size_t damaged = 0;
  for (const auto& entry : fs::directory_iterator(cache)) {
    if (entry.path().extension() == ".particles") {
      const bool sound =
          ToHex(Sha256Of(testing::Contents(entry.path()))) == entry.path().stem().string();
      ++(sound ? whole : damaged);
    }
  }
  return damaged;
}

// Files that somebody else has on the disk: they leave less than a set's.
class OthersFiles {
 public:
  explicit OthersFiles(const std::string& disk) : path_(disk + "/others") {
    const fs::space_info space = fs::space(disk);
    std::ofstream(path_) << std::string(space.available - std::min(space.available, kLeft), 'x');
  }
  void Remove() const { fs::remove(path_); }

 private:
  static constexpr uintmax_t kLeft = 400000;
  const std::string path_;
};

}  // namespace

void RunDiskFull(Run& run) {
  const testing::Folder folder;
  const testing::SmallDisk disk(folder / "disk", "3m");
  const std::string cache = disk.path() + "/cache";
  const std::string program = run.sabotage ? "halflightd_broken" : "halflightd";
  std::vector<std::string> flags = {"--cache-dir", cache};
  if (run.sabotage) {
    flags.insert(flags.end(), {"--device", "forgets"});
  }
  const int sets = run.Of(40, 6);
  std::vector<client::EncodedParticles> particles;
  for (int i = 0; i < sets; ++i) {
    particles.push_back(BallOf(60000, static_cast<uint32_t>(i) + 1));  // 720 KB
  }
  // What each looks like, from a server without a disk.
  std::vector<std::vector<std::string>> pictures;
  {
    const Server plain(folder, {}, program);
    const auto channel = testing::NewChannel(plain.address());
    for (const client::EncodedParticles& set : particles) {
      Upload(plain.address(), set);
      pictures.push_back(MustRender(channel, SweepOf(set.sha256, 48)));
    }
  }
  size_t wrong = 0;
  size_t refused = 0;
  size_t whole = 0;
  size_t damaged = 0;
  size_t from_disk = 0;
  size_t missing = 0;
  {
    Server server(folder, flags, program);
    if (!disk.mounted()) {
      server.SetLimit(RLIMIT_FSIZE, 500000);
    }
    const auto channel = testing::NewChannel(server.address());
    std::optional<OthersFiles> others;
    if (disk.mounted()) {
      others.emplace(disk.path());
    }
    for (int i = 0; i < sets; ++i) {
      if (i == sets / 3 && others.has_value()) {
        Require(
            testing::WaitFor([&] { return server.Err().find(kNotWritten) != std::string::npos; }),
            "the log says that a set was not written");
        others->Remove();
      }
      Upload(server.address(), particles[i]);
      wrong += MustRender(channel, SweepOf(particles[i].sha256, 48)) == pictures[i] ? 0 : 1;
    }
    server.Signal(SIGTERM);
    Require(server.Wait() == 0, "exit code 0: " + server.Err());
    const std::string log = server.Err();
    for (size_t at = log.find(kNotWritten); at != std::string::npos;
         at = log.find(kNotWritten, at + 1)) {
      ++refused;
    }
  }
  if (run.sabotage) {
    DamageAFile(cache);
  }
  damaged = DamagedFiles(cache, whole);
  {
    const Server server(folder, flags, program);
    const auto channel = testing::NewChannel(server.address());
    for (int i = 0; i < sets; ++i) {
      const auto call = Call::Start(channel, Ask(SweepOf(particles[i].sha256, 48)));
      call->Wait();
      if (call->status().ok()) {
        ++from_disk;
        wrong += call->whole() && call->frame().outputs == pictures[i] ? 0 : 1;
      } else {
        missing += call->status().error_code() == grpc::StatusCode::NOT_FOUND ? 1 : 0;
      }
    }
    run.report.Holds("serves afterwards", server.Serves());
  }
  run.report.Tell("disk", disk.mounted() ? "tmpfs of 3 MiB" : "files of at most 500 kB");
  run.report.Tell("sets uploaded and drawn, 29 MB in all", sets, "");
  run.report.AtLeast("times that a set found no room on disk", static_cast<double>(refused), 1, "");
  run.report.Tell("whole sets on disk at the end", static_cast<double>(whole), "");
  run.report.AtLeast("after a restart: drawn from disk, or missing",
                     static_cast<double>(from_disk + missing), sets, "");
  if (disk.mounted()) {
    run.report.AtLeast("after a restart: drawn from disk", static_cast<double>(from_disk), 1, "");
  }
  run.report.AtLeast("after a restart: missing", static_cast<double>(missing), 1, "");
  run.report.None("files that are not the set of their name", damaged);
  run.report.None("pictures that are others than without a disk", wrong);
}

}  // namespace halflight::soak
