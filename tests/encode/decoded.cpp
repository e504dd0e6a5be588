// Drives the image library's readers; see decoded.h.
#include "tests/encode/decoded.h"

#include <algorithm>
#include <utility>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

namespace halflight {
namespace {

DecodedPart Describe(const OIIO::ImageSpec& spec) {
  DecodedPart part;
  part.width = spec.width;
  part.height = spec.height;
  part.offset = {spec.x, spec.y};
  part.whole_window = {spec.full_x, spec.full_y, spec.full_width, spec.full_height};
  part.channels = spec.channelnames;
  part.sample_type = spec.format.c_str();
  for (const OIIO::ParamValue& attribute : spec.extra_attribs) {
    const std::string name = attribute.name().string();
    if (attribute.type() == OIIO::TypeString) part.texts[name] = attribute.get_string();
    if (attribute.type() == OIIO::TypeMatrix44) {
      const auto* first = static_cast<const float*>(attribute.data());
      std::copy(first, first + 16, part.matrices[name].begin());
    }
  }
  return part;
}

}  // namespace

std::vector<DecodedPart> Decode(const std::string& bytes, const std::string& format) {
  OIIO::Filesystem::IOMemReader proxy(bytes.data(), bytes.size());
  // Given a configuration, the readers look for the proxy there and nowhere else.
  OIIO::Filesystem::IOProxy* const proxy_address = &proxy;
  OIIO::ImageSpec config;
  config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy_address);
  config.attribute("oiio:UnassociatedAlpha", 1);  // do not multiply with alpha
  const auto input = OIIO::ImageInput::open("memory." + format, &config);
  std::vector<DecodedPart> parts;
  for (int index = 0; input != nullptr && input->seek_subimage(index, 0); ++index) {
    const OIIO::ImageSpec spec = input->spec();
    DecodedPart part = Describe(spec);
    const size_t count = spec.image_pixels() * part.channels.size();
    part.values.resize(count);
    part.codes.resize(count);
    const bool read =
        input->read_image(index, 0, 0, spec.nchannels, OIIO::TypeFloat, part.values.data()) &&
        input->read_image(index, 0, 0, spec.nchannels, OIIO::TypeUInt16, part.codes.data());
    if (!read) return {};
    parts.push_back(std::move(part));
  }
  return parts;
}

}  // namespace halflight
