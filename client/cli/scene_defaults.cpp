#include "client/cli/scene_defaults.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/framing.h"
#include "halflight/particle_payload.h"

namespace halflight::client {

namespace {

constexpr float kDefaultOpacity = 0.18F;  // as the service has it; said, so that it can be shown

Vec3 FromProto(const v1::Vector3& v) { return {v.x(), v.y(), v.z()}; }

void ToProto(const Vec3& from, v1::Vector3& to) {
  to.set_x(from[0]);
  to.set_y(from[1]);
  to.set_z(from[2]);
}

// Enough digits to tell the eye from the target where coordinates are large.
std::string Text(const Vec3& v) { return fmt::format("{:.9g},{:.9g},{:.9g}", v[0], v[1], v[2]); }

bool AllHave(const std::vector<const Particles*>& clouds, std::vector<float> Particles::*array) {
  return std::all_of(clouds.begin(), clouds.end(), [array](const Particles* cloud) {
    return !(cloud->*array).empty() || cloud->size() == 0;
  });
}

// The radius of particles that have none of their own.
double ChooseRadius(const std::vector<const Particles*>& clouds, v1::Scene& scene,
                    std::vector<Choice>& choices) {
  const auto filled = std::find_if(clouds.begin(), clouds.end(),
                                   [](const Particles* cloud) { return cloud->size() > 0; });
  if (filled != clouds.end() && AllHave(clouds, &Particles::radii)) {
    const auto [low, high] = std::minmax_element((*filled)->radii.begin(), (*filled)->radii.end());
    const std::string upward = *low < *high ? fmt::format(" to {:.6g}", *high) : "";
    choices.push_back({"radius", fmt::format("{:.6g}{}, from the file", *low, upward)});
    return 1;
  }
  if (scene.material().has_radius()) {
    choices.push_back({"radius", fmt::format("{:.6g}, as given", scene.material().radius())});
    return scene.material().radius();
  }
  if (filled == clouds.end()) {
    scene.mutable_material()->set_radius(1);
    choices.push_back({"radius", "1, since there are no particles"});
    return 1;
  }
  const double radius = EstimateRadius(**filled);
  scene.mutable_material()->set_radius(static_cast<float>(radius));
  choices.push_back(
      {"radius", fmt::format("{:.6g}, estimated from the spacing of the particles", radius)});
  return radius;
}

void ChooseOpacity(const std::vector<const Particles*>& clouds, v1::Scene& scene,
                   std::vector<Choice>& choices) {
  if (!clouds[0]->opacities.empty()) {
    choices.push_back({"opacity", "from the file"});
  } else if (scene.material().has_opacity()) {
    choices.push_back({"opacity", fmt::format("{:.6g}, as given", scene.material().opacity())});
  } else {
    scene.mutable_material()->set_opacity(kDefaultOpacity);
    choices.push_back({"opacity", fmt::format("{:.6g}, the default", kDefaultOpacity)});
  }
}

// A cloud where the offset of time takes it, as far as framing is concerned.
Particles Moved(const Particles& cloud, double seconds) {
  Particles moved;
  moved.origin = cloud.origin;
  moved.positions = cloud.positions;
  moved.radii = cloud.radii;
  for (size_t i = 0; i < cloud.velocities.size(); ++i) {
    const double position = moved.positions[i] + seconds * cloud.velocities[i];
    // The server refuses what lies beyond.
    moved.positions[i] = static_cast<float>(std::clamp(position, -kLargestLength, kLargestLength));
  }
  return moved;
}

// The view of a camera that has a matrix: rows are right, up and backward.
View ViewOf(const v1::Matrix4& matrix) {
  const auto& m = matrix.elements();
  View view{};
  if (m.size() == 16) {
    for (int axis = 0; axis < 3; ++axis) {
      const double eye = -(m[axis] * m[3] + m[4 + axis] * m[7] + m[8 + axis] * m[11]);
      view.eye[static_cast<size_t>(axis)] = eye;
      view.target[static_cast<size_t>(axis)] = eye - m[8 + axis];
    }
  }
  return view;
}

absl::Status ChooseCamera(const std::vector<const Particles*>& clouds, double radius,
                          v1::Camera& camera, std::vector<Choice>& choices, View& view, Vec3& up) {
  if (camera.has_world_to_camera()) {
    view = ViewOf(camera.world_to_camera());
    choices.push_back({"camera", "as given"});
    return absl::OkStatus();
  }
  v1::LookAt& look_at = *camera.mutable_look_at();
  const bool needs_height = camera.has_orthographic() && camera.orthographic().height() == 0;
  const bool complete = look_at.has_eye() && look_at.has_target();
  if ((!complete || needs_height) && clouds.empty()) {
    return absl::InvalidArgumentError(
        "scene.camera: eye, target or orthographic height is unset; allowed without an input file: "
        "all of them given (--eye, --target, --ortho-height)");
  }
  ViewWishes wishes;
  if (look_at.has_eye()) {
    wishes.eye = FromProto(look_at.eye());
  }
  if (look_at.has_target()) {
    wishes.target = FromProto(look_at.target());
  }
  if (look_at.has_up()) {
    wishes.up = FromProto(look_at.up());
  }
  if (wishes.up == Vec3{}) {
    return absl::InvalidArgumentError("--up: is '0,0,0'; allowed: any direction");
  }
  if (wishes.eye && wishes.eye == wishes.target) {
    return absl::InvalidArgumentError(fmt::format(
        "--eye: is '{}', the same as the target; allowed: any other place", Text(*wishes.eye)));
  }
  up = wishes.up;
  Projection projection;
  const double width = camera.width() == 0 ? 640 : camera.width();
  const double height = camera.height() == 0 ? 480 : camera.height();
  projection.aspect = width / height;
  projection.orthographic = camera.has_orthographic();
  if (camera.perspective().vertical_fov_deg() > 0) {
    projection.vertical_fov_deg = std::min(camera.perspective().vertical_fov_deg(), 179.0);
  }
  view = FrameParticles(clouds, radius, projection, wishes);
  if (complete) {
    view.eye = *wishes.eye;
    view.target = *wishes.target;
  }
  ToProto(view.eye, *look_at.mutable_eye());
  ToProto(view.target, *look_at.mutable_target());

  std::string projected = fmt::format("vertical field of view {:.6g}", projection.vertical_fov_deg);
  if (camera.has_orthographic()) {
    if (needs_height) {
      camera.mutable_orthographic()->set_height(view.orthographic_height);
    }
    projected = fmt::format("orthographic height {:.6g}", camera.orthographic().height());
  }
  const char* const why = complete                      ? "as given"
                          : wishes.eye || wishes.target ? "completed from the particles"
                                                        : "a view that frames all particles";
  choices.push_back({"camera", fmt::format("eye {} target {} up {}, {}, {}", Text(view.eye),
                                           Text(view.target), Text(up), projected, why)});
  return absl::OkStatus();
}

void ChooseLights(const View& view, const Vec3& up, v1::Scene& scene,
                  std::vector<Choice>& choices) {
  if (!scene.has_lighting()) {
    scene.mutable_lighting()->add_lights();
  }
  for (v1::Light& light : *scene.mutable_lighting()->mutable_lights()) {
    if (light.kind_case() == v1::Light::KIND_NOT_SET) {
      const Vec3 direction = SideLight(view, up);
      ToProto(direction, *light.mutable_directional()->mutable_direction());
      choices.push_back(
          {"light", fmt::format("direction {}, from the upper left of the view", Text(direction))});
    } else if (light.has_point()) {
      choices.push_back(
          {"light", fmt::format("point {}, as given", Text(FromProto(light.point().position())))});
    } else if (light.directional().has_direction()) {
      choices.push_back({"light", fmt::format("direction {}, as given",
                                              Text(FromProto(light.directional().direction())))});
    } else {
      v1::Vector3& direction = *light.mutable_directional()->mutable_direction();
      direction.set_x(view.target[0] - view.eye[0]);
      direction.set_y(view.target[1] - view.eye[1]);
      direction.set_z(view.target[2] - view.eye[2]);
      choices.push_back(
          {"light", fmt::format("direction {}, along the view", Text(FromProto(direction)))});
    }
  }
  if (scene.lighting().lights().empty()) {
    choices.push_back({"light", "none, as given"});
  }
}

}  // namespace

absl::Status FillInScene(const std::vector<const Particles*>& clouds,
                         v1::RenderFrameRequest& request, std::vector<Choice>& choices) {
  v1::Scene& scene = *request.mutable_scene();
  double radius = 1;
  if (!clouds.empty()) {
    radius = ChooseRadius(clouds, scene, choices);
    ChooseOpacity(clouds, scene, choices);
  }
  std::vector<Particles> moved;
  std::vector<const Particles*> framed = clouds;
  if (scene.time_offset_s() != 0) {
    moved.reserve(clouds.size());
    std::transform(clouds.begin(), clouds.end(), framed.begin(), [&](const Particles* cloud) {
      return &moved.emplace_back(Moved(*cloud, scene.time_offset_s()));
    });
  }
  View view{};
  Vec3 up = {0, 1, 0};
  if (absl::Status status =
          ChooseCamera(framed, radius, *scene.mutable_camera(), choices, view, up);
      !status.ok()) {
    return status;
  }
  ChooseLights(view, up, scene, choices);
  return absl::OkStatus();
}

}  // namespace halflight::client
