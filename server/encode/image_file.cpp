// Drives OpenImageIO's writers, one for each file; see image_file.h for what is left out.
#include "server/encode/image_file.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "absl/strings/str_cat.h"

namespace halflight {
namespace {

absl::Status LibraryError(const char* format, const OIIO::ImageOutput& output) {
  return absl::InternalError(absl::StrCat("writing ", format, ": ", output.geterror()));
}

absl::Status NoWriter(const char* format) {
  return absl::InternalError(absl::StrCat("no writer for ", format, ": ", OIIO::geterror()));
}

// A nameless file in memory. OpenImageIO 2.4 writes files of several parts only through a path,
// even when it is handed a proxy, so those go through the path that the kernel gives this one.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(memfd_create("image", MFD_CLOEXEC)) {}
  ~MemoryFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  MemoryFile(MemoryFile&&) = delete;
  MemoryFile& operator=(MemoryFile&&) = delete;

  [[nodiscard]] bool valid() const { return descriptor_ >= 0; }
  [[nodiscard]] std::string path() const { return absl::StrCat("/proc/self/fd/", descriptor_); }

  // Replaces `bytes` with all that was written.
  [[nodiscard]] absl::Status Read(std::string& bytes) const {
    struct stat info {};
    if (fstat(descriptor_, &info) != 0) {
      return absl::ErrnoToStatus(errno, "asking for the size of the encoded file");
    }
    bytes.resize(static_cast<size_t>(info.st_size));
    for (size_t offset = 0; offset < bytes.size();) {
      const ssize_t count = pread(descriptor_, bytes.data() + offset, bytes.size() - offset,
                                  static_cast<off_t>(offset));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return absl::ErrnoToStatus(errno, "reading the encoded file back");
      offset += static_cast<size_t>(count);
    }
    return absl::OkStatus();
  }

 private:
  int descriptor_;
};

OIIO::TypeDesc LibraryType(SampleType type) {
  switch (type) {
    case SampleType::kUint8:
      return OIIO::TypeUInt8;
    case SampleType::kUint16:
      return OIIO::TypeUInt16;
    case SampleType::kHalf:
      return OIIO::TypeHalf;
    case SampleType::kFloat:
      break;
  }
  return OIIO::TypeFloat;
}

struct SetAttribute {
  OIIO::ImageSpec& spec;
  const std::string& name;

  void operator()(int value) const { spec.attribute(name, value); }
  void operator()(const std::string& value) const { spec.attribute(name, value); }
  // OpenImageIO 2.4 keeps each string that it is given in a table until the process ends, and every
  // frame has others. So it gets the address of the text in place of the address in its table: to
  // its writers of PNG and EXR a ustring is a pointer to characters, and no more is looked at.
  void operator()(const Remark& value) const {
    static_assert(sizeof(OIIO::ustring) == sizeof(const char*));
    const char* const characters = value.text.c_str();
    OIIO::ustring text;
    std::memcpy(static_cast<void*>(&text), static_cast<const void*>(&characters), sizeof(text));
    spec.extra_attribs.add_or_replace(OIIO::ParamValue(name, text));
  }
  void operator()(const Chromaticities& value) const {
    spec.attribute(name, OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, static_cast<int>(value.size())),
                   value.data());
  }
  void operator()(const MatrixRows& value) const {
    spec.attribute(name, OIIO::TypeMatrix44, value.data());
  }
};

OIIO::ImageSpec MakeSpec(const ImageFile& file) {
  OIIO::ImageSpec spec(file.width, file.height, static_cast<int>(file.channels.size()),
                       LibraryType(file.stored));
  spec.channelnames = file.channels;
  // A single channel is never alpha to the library: it would look for colours to go with it.
  const auto alpha = std::find(file.channels.begin(), file.channels.end(), "A");
  const bool has_alpha = file.channels.size() > 1 && alpha != file.channels.end();
  spec.alpha_channel = has_alpha ? static_cast<int>(alpha - file.channels.begin()) : -1;
  if (file.display_size != glm::ivec2(0)) {
    spec.x = file.offset.x;
    spec.y = file.offset.y;
    spec.full_width = file.display_size.x;
    spec.full_height = file.display_size.y;
  }
  for (const auto& [name, value] : file.attributes) std::visit(SetAttribute{spec, name}, value);
  if (!file.associated_alpha) spec.attribute("oiio:UnassociatedAlpha", 1);
  return spec;
}

// Some rows at a time, between which the library asks whether to go on.
absl::Status WriteRows(const ImageFile& file, const void* pixels, const std::stop_token& stop,
                       OIIO::ImageOutput& output) {
  const auto stopped = [](void* token, float /*done*/) {
    return static_cast<const std::stop_token*>(token)->stop_requested();
  };
  std::stop_token token = stop;
  const bool written = output.write_image(LibraryType(file.given), pixels, OIIO::AutoStride,
                                          OIIO::AutoStride, OIIO::AutoStride, stopped, &token);
  if (stop.stop_requested()) return absl::CancelledError("encoding was cancelled");
  return written ? absl::OkStatus() : LibraryError(file.format, output);
}

absl::Status WriteOne(const ImageFile& file, const OIIO::ImageSpec& spec, const void* pixels,
                      const std::stop_token& stop, std::string& bytes) {
  std::vector<unsigned char> buffer;
  OIIO::Filesystem::IOVecOutput proxy(buffer);
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(file.format, &proxy);
  if (output == nullptr) return NoWriter(file.format);
  // The name is never opened; it only has to end as the format's files do.
  if (!output->open(absl::StrCat("memory.", file.format), spec)) {
    return LibraryError(file.format, *output);
  }
  if (absl::Status written = WriteRows(file, pixels, stop, *output); !written.ok()) return written;
  if (!output->close()) return LibraryError(file.format, *output);
  bytes.assign(buffer.begin(), buffer.end());
  return absl::OkStatus();
}

absl::Status WriteParts(const ImageFile& file, std::span<const OIIO::ImageSpec> specs,
                        const void* pixels, const std::stop_token& stop, std::string& bytes) {
  const MemoryFile memory;
  if (!memory.valid()) return absl::ErrnoToStatus(errno, "creating a file in memory");
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(file.format);
  if (output == nullptr) return NoWriter(file.format);
  if (!output->open(memory.path(), static_cast<int>(specs.size()), specs.data())) {
    return LibraryError(file.format, *output);
  }
  const auto* part_pixels = static_cast<const std::byte*>(pixels);
  for (const OIIO::ImageSpec& spec : specs) {
    const bool first = &spec == specs.data();
    if (!first && !output->open(memory.path(), spec, OIIO::ImageOutput::AppendSubimage)) {
      return LibraryError(file.format, *output);
    }
    if (absl::Status written = WriteRows(file, part_pixels, stop, *output); !written.ok()) {
      return written;
    }
    part_pixels += spec.image_pixels() * file.channels.size() * LibraryType(file.given).size();
  }
  if (!output->close()) return LibraryError(file.format, *output);
  return memory.Read(bytes);
}

}  // namespace

absl::Status WriteToMemory(const ImageFile& file, const void* pixels, const std::stop_token& stop,
                           std::string& bytes) {
  std::vector<OIIO::ImageSpec> specs(std::max<size_t>(1, file.parts.size()), MakeSpec(file));
  for (size_t part = 0; part < file.parts.size(); ++part) {
    specs[part].attribute("oiio:subimagename", file.parts[part]);
  }
  return specs.size() == 1 ? WriteOne(file, specs.front(), pixels, stop, bytes)
                           : WriteParts(file, specs, pixels, stop, bytes);
}

}  // namespace halflight
