// Programs of the build as processes, and what is left of them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <sys/types.h>

namespace halflight::testing {

// A new directory that goes with the object.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  [[nodiscard]] std::string operator/(const std::string& name) const;
  // The path of a file in it, with these bytes.
  [[nodiscard]] std::string Write(const std::string& name, const std::string& bytes) const;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

struct ProcessOptions {
  std::vector<std::string> environment{};  // "NAME=value", beside TMPDIR
  // Handed over as a service manager does: descriptors from 3 on, with LISTEN_FDS and LISTEN_PID.
  std::vector<int> sockets{};
  int err = -1;  // where its stderr goes instead
};

// One program that runs. Its TMPDIR is `folder`/tmp, and all that it prints is kept there too.
class Process {
 public:
  // `program` is looked for where the build puts programs.
  Process(const Folder& folder, const std::string& program, std::vector<std::string> arguments,
          ProcessOptions options = {});
  // Ends it by force where it still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  void Signal(int signal) const;
  // The exit code; -1 where it does not end within a minute, or of a signal.
  int Wait();
  [[nodiscard]] std::string Out() const;
  [[nodiscard]] std::string Err() const;
  // Of halflightd: the address in the line that says it listens.
  [[nodiscard]] std::string Address() const;
  // Of halflightd: whether its log has such a text.
  [[nodiscard]] bool Logged(const std::string& text) const;
  // While it runs: entries of a folder of /proc, "fd" or "task".
  [[nodiscard]] size_t Count(const std::string& what) const;

 private:
  std::string log_;  // the beginning of the names of both logs
  pid_t pid_ = -1;
};

// A program that has ended.
struct Ended {
  int code = -1;
  std::string out;
  std::string err;
};
Ended RunHalflight(const Folder& folder, const std::vector<std::string>& arguments,
                   const ProcessOptions& options = {});

// Processes whose command line has `text` in it.
int ProcessesWith(const std::string& text);

// The bytes of a file; none where there is no file.
std::string Contents(const std::string& path);

// A frame of the plume that the tests carry.
std::string PlumePath(const std::string& frame);

}  // namespace halflight::testing
