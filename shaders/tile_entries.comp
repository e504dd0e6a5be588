#version 450
#extension GL_GOOGLE_include_directive : require
// Writes an entry for every place of a run and each tile that it touches, by ascending place. One
// invocation an entry, so that a particle over the whole target takes no longer than small ones.
#include "bindings.h"
#include "tiles.glsl"

layout(std430, binding = kEntryBeginsBinding) readonly buffer Begins { uint begins[]; };
layout(std430, binding = kEntryTilesBinding) writeonly buffer EntryTiles { uint entry_tiles[]; };
layout(std430, binding = kEntryPlacesBinding) writeonly buffer Places { uint places[]; };

void main() {
  uint entry = InvocationIndex();
  if (entry >= tiles.entries.x) return;
  // The last place whose entries begin at this one or before.
  uint k = 0u;
  for (uint end = tiles.run.y; end - k > 1u;) {
    uint middle = k + (end - k) / 2u;
    if (begins[middle] <= entry) {
      k = middle;
    } else {
      end = middle;
    }
  }
  TileRange range = TilesOf(k);
  uint part = entry - begins[k];
  uvec2 tile = range.first + uvec2(part % range.count.x, part / range.count.x);
  entry_tiles[entry] = tile.y * tiles.tiles.x + tile.x;
  places[entry] = tiles.run.z + k;
}
