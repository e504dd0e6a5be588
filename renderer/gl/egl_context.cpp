#include "renderer/gl/egl_context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cctype>
#include <cstdlib>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace halflight::gl {

namespace {

// One place where a context may be had: an EGL device, or Mesa's surfaceless platform.
struct Candidate {
  EGLDeviceEXT device = EGL_NO_DEVICE_EXT;
  bool software = false;
  std::string description;
};

struct DeviceChoice {
  enum class Kind { kAuto, kSoftware, kUuid, kCuda, kDrm } kind = Kind::kAuto;
  std::string value;  // 32 hex digits, a CUDA index, or a path
};

// EGL_EXT_device_drm_render_node, which is younger than Debian 12's libepoxy.
constexpr EGLint kDrmRenderNodeFile = 0x3377;

bool HasExtension(const char* list, const char* extension) {
  if (list == nullptr) return false;
  const std::vector<std::string> words = absl::StrSplit(list, ' ');
  for (const std::string& word : words) {
    if (word == extension) return true;
  }
  return false;
}

absl::StatusOr<DeviceChoice> ParseDeviceChoice(const std::string& text) {
  using Kind = DeviceChoice::Kind;
  if (text.empty() || text == "auto") return DeviceChoice{Kind::kAuto, ""};
  if (text == "software") return DeviceChoice{Kind::kSoftware, ""};
  const size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  std::string value = colon == std::string::npos ? "" : text.substr(colon + 1);
  if (kind == "uuid") {
    std::string digits;
    for (const char c : value) {
      if (c != '-') digits += absl::ascii_tolower(static_cast<unsigned char>(c));
    }
    if (digits.starts_with("gpu")) digits.erase(0, 3);  // as nvidia-smi prints it
    bool hexadecimal = digits.size() == 32;
    for (const char c : digits) hexadecimal &= std::isxdigit(static_cast<unsigned char>(c)) != 0;
    if (hexadecimal) return DeviceChoice{Kind::kUuid, digits};
  }
  int index = 0;
  if (kind == "cuda" && absl::SimpleAtoi(value, &index) && index >= 0) {
    return DeviceChoice{Kind::kCuda, absl::StrCat(index)};
  }
  if (kind == "drm" && value.starts_with('/')) return DeviceChoice{Kind::kDrm, value};
  return absl::InvalidArgumentError(absl::StrCat(
      "device: \"", text,
      "\", allowed: auto, software, uuid:<32 hex digits>, cuda:<index>, drm:</dev/dri/...>"));
}

std::vector<Candidate> FindCandidates() {
  std::vector<Candidate> candidates;
  const char* client_extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (HasExtension(client_extensions, "EGL_EXT_device_enumeration") ||
      HasExtension(client_extensions, "EGL_EXT_device_base")) {
    EGLint count = 0;
    eglQueryDevicesEXT(0, nullptr, &count);
    std::vector<EGLDeviceEXT> devices(static_cast<size_t>(count));
    eglQueryDevicesEXT(count, devices.data(), &count);
    for (EGLint i = 0; i < count; ++i) {
      const EGLDeviceEXT device = devices[static_cast<size_t>(i)];
      const char* extensions = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
      candidates.push_back({device, HasExtension(extensions, "EGL_MESA_device_software"),
                            absl::StrCat("EGL device ", i)});
    }
  }
  if (candidates.empty() && HasExtension(client_extensions, "EGL_MESA_platform_surfaceless")) {
    // Mesa decides by itself here what it draws with.
    candidates.push_back({EGL_NO_DEVICE_EXT, true, "EGL surfaceless platform"});
  }
  return candidates;
}

// Whether the device is the one named by `choice`, as far as EGL can tell: a UUID needs a context.
bool Matches(const Candidate& candidate, const DeviceChoice& choice) {
  using Kind = DeviceChoice::Kind;
  if (choice.kind == Kind::kAuto) return true;
  if (choice.kind == Kind::kSoftware) return candidate.software;
  if (candidate.device == EGL_NO_DEVICE_EXT) return false;
  const char* extensions = eglQueryDeviceStringEXT(candidate.device, EGL_EXTENSIONS);
  if (choice.kind == Kind::kCuda) {
    // Asked for without the extension, the attribute is an error that some drivers turn into 0.
    EGLAttrib index = -1;
    return HasExtension(extensions, "EGL_NV_device_cuda") &&
           eglQueryDeviceAttribEXT(candidate.device, EGL_CUDA_DEVICE_NV, &index) == EGL_TRUE &&
           absl::StrCat(index) == choice.value;
  }
  if (choice.kind == Kind::kDrm) {
    for (const auto& [extension, name] :
         {std::pair{"EGL_EXT_device_drm", EGLint{EGL_DRM_DEVICE_FILE_EXT}},
          std::pair{"EGL_EXT_device_drm_render_node", kDrmRenderNodeFile}}) {
      if (!HasExtension(extensions, extension)) continue;
      const char* path = eglQueryDeviceStringEXT(candidate.device, name);
      if (path != nullptr && choice.value == path) return true;
    }
    return false;
  }
  return !candidate.software;
}

// GL_DEVICE_UUID_EXT of the current context in hex; empty where the driver does not tell.
std::string CurrentDeviceUuid() {
  if (!epoxy_has_gl_extension("GL_EXT_memory_object")) return "";
  std::array<GLubyte, GL_UUID_SIZE_EXT> uuid = {};
  glGetUnsignedBytei_vEXT(GL_DEVICE_UUID_EXT, 0, uuid.data());
  std::string hex;
  for (const GLubyte byte : uuid) absl::StrAppend(&hex, absl::Hex(byte, absl::kZeroPad2));
  return hex;
}

absl::Status EglError(const Candidate& candidate, const char* call) {
  return absl::UnavailableError(absl::StrCat(candidate.description, ": ", call,
                                             " failed, EGL error 0x",
                                             absl::Hex(static_cast<uint32_t>(eglGetError()))));
}

}  // namespace

struct EglContext::Handles {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;

  Handles() = default;
  Handles(const Handles&) = delete;
  Handles& operator=(const Handles&) = delete;
  ~Handles() {
    if (context != EGL_NO_CONTEXT) {
      eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
      eglDestroyContext(display, context);
    }
    // The display is not terminated: EGL shares it with whoever else in the process asked for the
    // same device, and epoxy's entry points stay bound to it.
  }

  absl::Status Open(const Candidate& candidate) {
    display =
        candidate.device == EGL_NO_DEVICE_EXT
            ? eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr)
            : eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, candidate.device, nullptr);
    if (display == EGL_NO_DISPLAY) return EglError(candidate, "eglGetPlatformDisplayEXT");
    if (eglInitialize(display, nullptr, nullptr) != EGL_TRUE) {
      return EglError(candidate, "eglInitialize");
    }
    if (!HasExtension(eglQueryString(display, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context")) {
      return absl::UnavailableError(
          absl::StrCat(candidate.description, ": no EGL_KHR_surfaceless_context"));
    }
    if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return EglError(candidate, "eglBindAPI");
    constexpr std::array<EGLint, 5> kConfig = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE,
                                               EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint configs = 0;
    eglChooseConfig(display, kConfig.data(), &config, 1, &configs);
    if (!configs) config = nullptr;
    // One that tells of resets, where the driver has it.
    if (!MakeContext(config,
                     {EGL_CONTEXT_OPENGL_ROBUST_ACCESS, EGL_TRUE,
                      EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY, EGL_LOSE_CONTEXT_ON_RESET}) &&
        !MakeContext(config, {})) {
      return EglError(candidate, "eglCreateContext");
    }
    if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) != EGL_TRUE) {
      return EglError(candidate, "eglMakeCurrent");
    }
    if (epoxy_gl_version() < 46 && !epoxy_has_gl_extension("GL_ARB_gl_spirv")) {
      return absl::UnavailableError(
          absl::StrCat(candidate.description, ": no GL_ARB_gl_spirv (", DescribeGl(), ")"));
    }
    return absl::OkStatus();
  }

  bool MakeContext(EGLConfig config, std::vector<EGLint> attributes) {
    attributes.insert(attributes.end(), {EGL_CONTEXT_MAJOR_VERSION, 4, EGL_CONTEXT_MINOR_VERSION, 5,
                                         EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                         EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE});
    context = eglCreateContext(display, config, EGL_NO_CONTEXT, attributes.data());
    return context != EGL_NO_CONTEXT;
  }

  static std::string DescribeGl() {
    return absl::StrCat(reinterpret_cast<const char*>(glGetString(GL_RENDERER)), ", ",
                        reinterpret_cast<const char*>(glGetString(GL_VERSION)));
  }
};

EglContext::EglContext(std::unique_ptr<Handles> handles, DeviceInfo device)
    : handles_(std::move(handles)), device_(std::move(device)) {}

EglContext::~EglContext() = default;

absl::StatusOr<std::unique_ptr<EglContext>> EglContext::Create(const std::string& device) {
  const absl::StatusOr<DeviceChoice> choice = ParseDeviceChoice(device);
  if (!choice.ok()) return choice.status();

  // GPUs before software renderers, each in EGL's order.
  std::vector<Candidate> candidates;
  const std::vector<Candidate> all = FindCandidates();
  for (const bool software : {false, true}) {
    for (const Candidate& candidate : all) {
      if (candidate.software == software && Matches(candidate, *choice)) {
        candidates.push_back(candidate);
      }
    }
  }

  std::string refusals;
  for (const Candidate& candidate : candidates) {
    auto handles = std::make_unique<Handles>();
    if (const absl::Status opened = handles->Open(candidate); !opened.ok()) {
      absl::StrAppend(&refusals, "; ", opened.message());
      continue;
    }
    if (choice->kind == DeviceChoice::Kind::kUuid && CurrentDeviceUuid() != choice->value) continue;
    DeviceInfo info;
    info.gl_renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    info.gl_version = reinterpret_cast<const char*>(glGetString(GL_VERSION));
    info.software = info.gl_renderer.find("llvmpipe") != std::string::npos ||
                    info.gl_renderer.find("softpipe") != std::string::npos;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &info.max_texture_size);
    GLint strategy = GL_NO_RESET_NOTIFICATION;
    glGetIntegerv(GL_RESET_NOTIFICATION_STRATEGY, &strategy);
    info.tells_of_resets = strategy == GL_LOSE_CONTEXT_ON_RESET;
    return std::unique_ptr<EglContext>(new EglContext(std::move(handles), std::move(info)));
  }
  const bool named = choice->kind != DeviceChoice::Kind::kAuto;
  const std::string summary =
      absl::StrCat("device: \"", device.empty() ? "auto" : device, "\", found ", all.size(),
                   " EGL devices, none usable", refusals);
  return named ? absl::NotFoundError(summary) : absl::UnavailableError(summary);
}

}  // namespace halflight::gl
