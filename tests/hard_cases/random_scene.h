// Small scenes drawn at random, with everything a scene can have present or absent.
// Holds no expectations: tests/hard_cases/properties.h has those.
#pragma once

#include <cstdint>
#include <random>
#include <string>

#include <glm/vec3.hpp>

#include "renderer/scene.h"

namespace halflight::fuzz {

// Random numbers that are the same with every standard library.
class Dice {
 public:
  Dice(uint64_t seed, uint64_t number) : engine_(seed * 0x9E3779B97F4A7C15U + number) {}

  double Unit() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }  // [0, 1)
  double Between(double low, double high) { return low + (high - low) * Unit(); }
  int Integer(int low, int high) { return low + static_cast<int>(Unit() * (high - low + 1)); }
  bool Chance(double probability) { return Unit() < probability; }
  glm::dvec3 Vector(double low, double high);
  glm::dvec3 Direction();  // unit length

 private:
  std::mt19937_64 engine_;
};

// 1 to 300 particles of any attributes in a cloud of any scale anywhere, seen from outside or
// within, under up to three lights of any kind. No two particles lie so nearly at the same place in
// an order that matters that rounding might swap them, and none exactly at the same.
Scene DrawScene(Dice& dice);

// For people: what was drawn, on a few lines.
std::string Describe(const Scene& scene);

}  // namespace halflight::fuzz
