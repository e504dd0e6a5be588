#version 450
#extension GL_GOOGLE_include_directive : require
// Finds where each tile begins among entries sorted by tile, and after the last where all end.
#include "bindings.h"
#include "tiles.glsl"

layout(std430, binding = kEntryTilesBinding) readonly buffer EntryTiles { uint entry_tiles[]; };
layout(std430, binding = kTileBeginsBinding) writeonly buffer Begins { uint tile_begins[]; };

void main() {
  uint tile = InvocationIndex();
  if (tile > tiles.tiles.x * tiles.tiles.y) return;
  // The first entry of this tile or a later one.
  uint first = 0u;
  for (uint end = tiles.entries.x; first < end;) {
    uint middle = first + (end - first) / 2u;
    if (entry_tiles[middle] < tile) {
      first = middle + 1u;
    } else {
      end = middle;
    }
  }
  tile_begins[tile] = first;
}
