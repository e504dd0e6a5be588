// Writes one JSON object a line, for --json. Reads none; requests are protobuf JSON
// (request_builder.h).
#pragma once

#include <fmt/format.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>

#include <string>
#include <string_view>

namespace halflight::client {

inline std::string JsonString(std::string_view text) {
  std::string json = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      json += '\\';
      json += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      json += fmt::format("\\u{:04x}", static_cast<int>(c));
    } else {
      json += c;
    }
  }
  return json + '"';
}

inline std::string JsonOf(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string json;
  const auto status = google::protobuf::util::MessageToJsonString(message, &json, options);
  return status.ok() ? json : "null";
}

// Members in the order in which they are added.
class JsonObject {
 public:
  // `json` is a value as it is written: an object, an array.
  void AddJson(std::string_view name, std::string_view json) {
    members_ += fmt::format("{}{}:{}", members_.empty() ? "" : ",", JsonString(name), json);
  }
  void Add(std::string_view name, std::string_view text) { AddJson(name, JsonString(text)); }
  template <typename Number>
  void AddNumber(std::string_view name, Number number) {
    AddJson(name, fmt::format("{}", number));
  }
  [[nodiscard]] std::string Text() const { return "{" + members_ + "}"; }

 private:
  std::string members_;
};

}  // namespace halflight::client
