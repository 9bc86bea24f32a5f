// SPDX-License-Identifier: Apache-2.0
// Buffers of the kernels that build active regions.
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_shader_explicit_arithmetic_types_int8 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_8bit_storage : require

#include "region_interface.h"

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer BlockArray { GpuBlock at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer SubblockArray { GpuSubblock at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer RangeArray { GpuSubblock at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer UintArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer IntervalArray { vec2 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 1) buffer StateArray { uint8_t at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer FloatArray { float at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Counter { uint count; };

layout(local_size_x = kRegionGroupSide, local_size_y = kRegionGroupSide, local_size_z = kRegionGroupSide) in;

// x fastest.
uint latticeIndex(ivec3 cell, ivec3 dims) { return uint(cell.x) + uint(dims.x) * (uint(cell.y) + uint(dims.y) * uint(cell.z)); }

bool isInside(ivec3 cell, ivec3 dims) { return all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, dims)); }
