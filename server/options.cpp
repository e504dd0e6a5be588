#include "server/options.h"

#include <algorithm>
#include <cstring>
#include <ostream>
#include <thread>

#include <sys/un.h>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "absl/strings/numbers.h"
#include "server/convert/field_checks.h"
#include "server/limit_flags.h"
#include "server/status_text.h"
#include "server/version.h"

namespace halflight {
namespace {

constexpr const char* kLogLevels = "trace, debug, info, warn, error, off";
constexpr double kMaxPort = 65535.0;

// The longest path that a socket address holds, with its final zero.
constexpr size_t kMaxSocketPath = sizeof(sockaddr_un::sun_path) - 1;

void AddFlags(CLI::App& app, Options& options) {
  app.add_option("--address", options.addresses,
                 fmt::format("Where to listen, host:port or unix:path; may be given several times. "
                             "Port 0 takes a free one, which is logged. Default: {}, or what "
                             "systemd hands over",
                             kDefaultAddress))
      ->type_name("ADDRESS");
  app.add_option("--device", options.device,
                 "What to render on: auto, software, uuid:<32 hex digits>, cuda:<index> or "
                 "drm:<path>")
      ->capture_default_str();
  app.add_option("--encode-threads", options.encode_threads,
                 "Threads that encode images; 0: one for each core but one")
      ->check(DecimalNumber());
  app.add_option("--drain-seconds", options.drain_seconds,
                 "How long what runs may go on after SIGTERM")
      ->capture_default_str()
      ->check(DecimalNumber());
  app.add_option("--watchdog-seconds", options.watchdog_seconds,
                 "How long the device may not come back from a frame that was cancelled or took "
                 "too long before halflightd ends with exit code 4; 0: for ever")
      ->capture_default_str()
      ->check(DecimalNumber());
  // For tests, so not listed: drawings that shall find the device failing.
  app.add_option_function<std::string>(
         "--plan-device-faults",
         [&options](const std::string& text) {
           auto faults = PlannedFaults::Parse(text);
           if (!faults.ok()) {
             throw CLI::ValidationError("--plan-device-faults", MessageOf(faults.status()));
           }
           options.faults = std::make_shared<PlannedFaults>(*std::move(faults));
         })
      ->group("");
}

void AddObservabilityFlags(CLI::App& app, Options& options) {
  const char* const group = "Observability";
  app.add_option("--log-level", options.log_level, fmt::format("One of {}", kLogLevels))
      ->capture_default_str()
      ->group(group);
  app.add_option_function<std::string>(
         "--log-format",
         [&options](const std::string& format) {
           options.log_format = format == "json" ? LogFormat::kJson : LogFormat::kText;
         },
         "Of the lines on stderr: text (key=value) or json")
      ->check(CLI::IsMember({"text", "json"}))
      ->default_str("text")
      ->group(group);
  app.add_option("--metrics-address", options.metrics.address,
                 "Where to show metrics to Prometheus, as http://<address>/metrics: host:port or "
                 "unix:path. Unset: nowhere")
      ->type_name("ADDRESS")
      ->group(group);
  app.add_flag("--insecure-metrics", options.metrics.insecure,
               "Show metrics also where others than this machine can connect")
      ->group(group);
  app.add_option_function<std::string>(
         "--channelz",
         [&options](const std::string& serve) {
           options.channelz = serve == "auto" ? std::nullopt : std::optional<bool>(serve == "on");
         },
         "Whether to serve grpc.channelz.v1, which tells everybody who can connect of calls, "
         "connections and their peers' addresses: on, off, or auto: where only this machine can "
         "connect and nobody has to say who calls")
      ->check(CLI::IsMember({"auto", "on", "off"}))
      ->default_str("auto")
      ->group(group);
}

void AddAccessFlags(CLI::App& app, AccessOptions& access) {
  // Left empty by a template, say, it would let everybody in.
  const CLI::Validator not_empty(
      [](const std::string& path) { return path.empty() ? "\"\", allowed: a path" : ""; }, "");
  const auto file = [&](const std::string& flag, std::string& path, const std::string& help) {
    app.add_option(flag, path, help)->type_name("FILE")->check(not_empty)->group("Access");
  };
  file("--tls-cert", access.tls.certificate,
       "Certificate chain in PEM: connections are encrypted. Files of this group are read again "
       "when they change");
  file("--tls-key", access.tls.key, "Its private key in PEM");
  file("--tls-client-ca", access.tls.client_authorities,
       "Authorities in PEM whose client certificates say who calls; calls without one, or a token, "
       "are refused");
  file("--token-file", access.token_file,
       "Bearer tokens that say who calls, lines '<SHA-256 of the token in hex> <tenant>'; calls "
       "without one, or a client certificate, are refused");
  app.add_flag("--insecure-listen", access.insecure_listen,
               "Listen also where others than this machine can connect although calls are not "
               "encrypted, or not authenticated")
      ->group("Access");
}

void CheckAddress(const char* flag, const std::string& address, FieldChecks& checks) {
  const std::string allowed = fmt::format(
      "host:port with a port from 0 to 65535, or unix:path of at most {} bytes", kMaxSocketPath);
  if (address.rfind("unix:", 0) == 0) {
    const size_t length = address.size() - std::strlen("unix:");
    if (length == 0 || length > kMaxSocketPath) {
      checks.Reject(flag, address, allowed);
    }
    return;
  }
  const size_t colon = address.rfind(':');
  int port = -1;
  if (colon == std::string::npos || colon == 0 ||
      !absl::SimpleAtoi(address.substr(colon + 1), &port) || port < 0 || port > kMaxPort) {
    checks.Reject(flag, address, allowed);
  }
}

void CheckAddresses(const std::vector<std::string>& addresses, FieldChecks& checks) {
  for (const std::string& address : addresses) {
    CheckAddress("--address", address, checks);
    const bool fixed = address.size() < 2 || address.compare(address.size() - 2, 2, ":0") != 0;
    if (fixed && std::count(addresses.begin(), addresses.end(), address) > 1) {
      checks.Reject("--address", address + " twice", "each address once");
    }
  }
}

void CheckTls(const TlsPaths& tls, FieldChecks& checks) {
  if (tls.key.empty() != tls.certificate.empty()) {
    checks.Reject(tls.key.empty() ? "--tls-key" : "--tls-cert", "\"\"",
                  "certificate and key together");
  }
  if (tls.certificate.empty() && !tls.client_authorities.empty()) {
    checks.Reject("--tls-client-ca", tls.client_authorities, "with --tls-cert and --tls-key");
  }
}

absl::Status Check(const Options& options) {
  FieldChecks checks;
  CheckAddresses(options.addresses, checks);
  CheckTls(options.access.tls, checks);
  if (!options.metrics.address.empty()) {
    CheckAddress("--metrics-address", options.metrics.address, checks);
  }
  const std::vector<std::string> levels = {"trace", "debug", "info", "warn", "error", "off"};
  if (std::find(levels.begin(), levels.end(), options.log_level) == levels.end()) {
    checks.Reject("--log-level", options.log_level, kLogLevels);
  }
  checks.InRange("--encode-threads", options.encode_threads, {.low = 0.0, .high = 256.0});
  checks.InRange("--drain-seconds", options.drain_seconds, {.low = 0.0, .high = 86400.0});
  checks.InRange("--watchdog-seconds", options.watchdog_seconds, {.low = 0.0, .high = 86400.0});
  CheckLimits(options, checks);
  return checks.status();
}

// CLI11 does not say whether a wrong value stood in the file, so that both are named.
std::string ParseMessage(const CLI::ParseError& error, const std::string& config_file) {
  const std::string what = error.what();
  const std::string unknown = "INI was not able to parse ";
  if (what.rfind(unknown, 0) == 0) {
    return fmt::format("{}: {}: is no flag, allowed: those that --help lists, without dashes",
                       config_file, what.substr(unknown.size()));
  }
  return config_file.empty() ? what : fmt::format("{} (given, or in {})", what, config_file);
}

}  // namespace

absl::StatusOr<std::optional<Options>> ParseOptions(int argc, const char* const* argv,
                                                    std::ostream& out) {
  Options options;
  CLI::App app("halflightd: renders particle clouds for clients over gRPC", "halflightd");
  app.set_version_flag("--version", std::string("halflightd ") + kVersion);
  AddFlags(app, options);
  AddObservabilityFlags(app, options);
  AddAccessFlags(app, options.access);
  AddLimitFlags(app, options);
  const CLI::Option* const config =
      app.set_config("--config", "",
                     "Flags that are not given are taken from this file: lines "
                     "'<flag> = <value>', the flag without its dashes");
  app.allow_config_extras(CLI::config_extras_mode::error);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    app.exit(success, out, out);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    return absl::InvalidArgumentError(ParseMessage(error, config->as<std::string>()));
  }
  FillInShares(app, options.limits);
  if (absl::Status status = Check(options); !status.ok()) {
    return status;
  }
  if (options.encode_threads == 0) {
    const auto cores = static_cast<int>(std::thread::hardware_concurrency());
    options.encode_threads = std::max(1, cores - 1);
  }
  if (options.cache_dir.empty()) {
    options.limits.max_cache_dir_bytes = 0;
  }
  return options;
}

}  // namespace halflight
