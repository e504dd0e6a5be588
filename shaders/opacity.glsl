// Opacity from optical depth and back, with all digits for small values too, where 1 - exp(-x) and
// log(1 - a) keep none.

const float kSeriesLimit = 0.125;

// 1 - exp(-x), x >= 0. Below the limit the series' rest is x^6 / 720 < 6e-9.
float OpacityFromOpticalDepth(float x) {
  float series = x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0)))));
  return x < kSeriesLimit ? series : 1.0 - exp(-x);
}

// -log(1 - a) for an opacity a whose complement, 1 - a, is known by itself to all its digits; a may
// be below 0, for light gained. Within the limit the series' rest is a^8 / 8 < 8e-9.
float OpticalDepthFromOpacity(float a, float complement) {
  float series =
      a * (1.0 + a * (0.5 + a * (1.0 / 3.0 +
           a * (0.25 + a * (0.2 + a * (1.0 / 6.0 + a * (1.0 / 7.0)))))));
  return abs(a) < kSeriesLimit ? series : -log(complement);
}
