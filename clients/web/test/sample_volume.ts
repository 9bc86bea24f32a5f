// SPDX-License-Identifier: Apache-2.0
// A volume's description as the server writes it.

export function sampleVolume(id: string, type: string) {
  return {
    id,
    name: `${id} of the mock`,
    type,
    dims: [96, 80, 64],
    spacing: [1, 1, 2],
    world_from_index: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 2, 0]],
    world_box: [0, 0, 0, 96, 80, 128],
    unit_distance: 1,
    value_scale: 1,
    value_offset: 0,
    empty_threshold: 0,
    density_range: [10, 250],
    histogram: { lo: 10, hi: 250, counts: Array.from({ length: 256 }, (_, i) => Math.round(9000 * Math.exp(-(((i - 70) / 22) ** 2)) + 500 * Math.exp(-(((i - 190) / 30) ** 2)))) },
    levels: [{ level: 0, dims: [96, 80, 64], blocks: 12, subblocks: 700, stored_bytes: 1433600 }],
    stored_bytes: 1433600,
    dense_bytes: 1966080,
    file_bytes: 1500000,
    nonempty_share: 0.31,
    source: "mock",
    default_view: { eye: [248, 200, 304], target: [48, 40, 64], up: [0, 1, 0], fov: 40, range: [10, 250] },
  };
}
