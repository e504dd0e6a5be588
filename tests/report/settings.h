// The settings that the report compares, as curves: one way of drawing, at rising numbers of slices
// or degrees. Leaves out what they are measured on; see scenes.h.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "renderer/scene.h"

namespace halflight::report {

struct Setting {
  std::string curve;  // the name of its row in the table of settings.cpp
  size_t curve_index;
  std::string name;   // the curve's, and what sets it apart on the curve: one name, one setting
  std::string label;  // the latter alone: its slices or degree; empty where the technique has none
  std::string flags;  // of `halflight render`
  ShadowSettings shadow;
  Sampling sampling;
  bool baseline = false;    // what times are ratios to
  size_t scaling_most = 0;  // measured against the number of particles, up to this one
};

// All of them, or those of the short form; one of them is the baseline.
std::vector<Setting> ListSettings(bool short_form);

// `scene` as the setting draws it.
Scene Apply(const Setting& setting, const Scene& scene);

}  // namespace halflight::report
