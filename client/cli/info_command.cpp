#include "client/cli/info_command.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <cstdint>
#include <string>

#include "absl/strings/ascii.h"
#include "client/cli/connection.h"
#include "client/cli/flag_values.h"
#include "client/cli/json.h"

namespace halflight::client {

namespace {

// "half_angle" from SHADOW_TECHNIQUE_HALF_ANGLE.
std::string ShortName(const std::string& enumerator, size_t prefix) {
  return absl::AsciiStrToLower(enumerator.size() > prefix ? enumerator.substr(prefix) : enumerator);
}

// All of them, under the names that docs/operations.md and requests' errors use.
void PrintLimits(const v1::ServerLimits& limits) {
  const google::protobuf::Descriptor& fields = *limits.GetDescriptor();
  const google::protobuf::Reflection& values = *limits.GetReflection();
  fmt::print("limits:\n");
  for (int i = 0; i < fields.field_count(); ++i) {
    const google::protobuf::FieldDescriptor& field = *fields.field(i);
    const bool wide = field.cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_UINT64;
    const uint64_t value =
        wide ? values.GetUInt64(limits, &field) : values.GetUInt32(limits, &field);
    fmt::print("  {} {}\n", field.name(), value);
  }
}

void Print(const v1::GetServerInfoResponse& info) {
  std::string techniques;
  for (const int technique : info.techniques()) {
    techniques += " " + ShortName(v1::ShadowTechnique_Name(technique), 17);
  }
  std::string outputs;
  for (const int kind : info.output_kinds()) {
    outputs += " " + OutputName(static_cast<v1::OutputKind>(kind));
  }
  std::string formats;
  for (const int format : info.formats()) {
    formats += " " + ShortName(v1::ImageFormat_Name(format), 13);
  }
  fmt::print("halflightd {}\nrenderer: {}\nOpenGL: {}\ntechniques:{}\noutputs:{}\nformats:{}\n",
             info.server_version(), info.gl_renderer(), info.gl_version(), techniques, outputs,
             formats);
  PrintLimits(info.limits());
}

}  // namespace

absl::Status RunInfo(const InfoOptions& options, const std::stop_token& stop) {
  auto connection = Connection::Open(options.connection, stop);
  if (!connection.ok()) {
    return connection.status();
  }
  const auto info = connection->client().GetServerInfo();
  if (!info.ok()) {
    return info.status();
  }
  if (options.json) {
    fmt::print("{}\n", JsonOf(*info));
  } else {
    Print(*info);
  }
  return absl::OkStatus();
}

}  // namespace halflight::client
