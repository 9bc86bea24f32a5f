// SPDX-License-Identifier: Apache-2.0
// A volume's description as the server writes it.

const kRange = [10, 250];
const kHistogram = { lo: 10, hi: 250, counts: Array.from({ length: 256 }, (_, i) => Math.round(9000 * Math.exp(-(((i - 70) / 22) ** 2)) + 500 * Math.exp(-(((i - 190) / 30) ** 2)))) };
const kColours = ["00ff00", "ff00ff", "00ffff", "ffff00"];

// A channel for each name; channel n has all values n times 1000 higher than the first.
export function sampleVolume(id: string, type: string, names: readonly string[] = [""]) {
  const channels = names.map((name, n) => ({
    name,
    value_scale: 1,
    value_offset: 0,
    empty_threshold: 0,
    density_range: kRange.map((bound) => bound + 1000 * n),
    histogram: { lo: 10 + 1000 * n, hi: 250 + 1000 * n, counts: kHistogram.counts },
    nonempty_share: 0.31,
  }));
  const own = { range: channels.map((channel) => channel.density_range), tf: names.map((_, n) => `${1000 * n}:000000:0,${1000 * n + 100}:808080:0.06,${1000 * n + 255}:${kColours[n]}:0.4`) };
  return {
    ...channels[0],
    id,
    name: `${id} of the mock`,
    type,
    dims: [96, 80, 64],
    spacing: [1, 1, 2],
    world_from_index: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 2, 0]],
    world_box: [0, 0, 0, 96, 80, 128],
    nonempty_box: [0, 0, 0, 96, 80, 64],
    unit_distance: 1,
    levels: [{ level: 0, dims: [96, 80, 64], blocks: 12, subblocks: 700, stored_bytes: 1433600 }],
    stored_bytes: 1433600,
    dense_bytes: 1966080,
    file_bytes: 1500000,
    source: "mock",
    metadata: { length_unit: "mm" },
    channels,
    default_view: {
      eye: [196.59698032001538, 158.8775842560123, 242.31637638401844], target: [48, 40, 64], up: [0, 1, 0], fov: 40,
      ...(names.length > 1 ? own : { range: own.range[0], ...(type !== "rgba8" && { tf: own.tf[0] }) }),
    },
  };
}

// CT as the server sees it first: air, soft tissue and bone, and colours by tissue.
export function sampleCt(id: string) {
  const volume = sampleVolume(id, "u16");
  const counts = Array.from({ length: 256 }, (_, i) => ({ 2: 9000, 120: 5000, 250: 500 })[i] ?? 0);
  const channel = { ...volume.channels[0], unit: "HU", density_range: [-999, 1500], histogram: { lo: -1000, hi: 1500, counts } };
  const tf = "-200:e8c39e:0,-90:e8c39e:0.012,20:c8694c:0.06,80:b04a3a:0.15,200:e8d8bc:0.4,1000:ffffff:0.8";
  return { ...volume, ...channel, id, name: `${id} of the mock`, channels: [channel], default_view: { ...volume.default_view, range: [-999, 1500], tf } };
}

// Labels from 1 to `count`, some of them with names; no voxel is a 5 where each has a bar of the histogram.
export function sampleLabels(id: string, count: number, names: Readonly<Record<number, string>> = {}) {
  const volume = sampleVolume(id, count < 256 ? "u8" : count < 65536 ? "u16" : "f32");
  const step = Math.max(1, Math.ceil(count / 1024));
  const hex = (value: number): string => (value & 0xffffff).toString(16).padStart(6, "0");
  const tf = Array.from({ length: Math.ceil(count / step) }, (_, i) => `${1 + i * step}:${hex(1 + i * step)}:0.3`).join(",");
  const top = Math.max(255, count);
  const channel = {
    ...volume.channels[0],
    values: "labels",
    labels: Object.entries(names).map(([value, name]) => ({ value: Number(value), name })),
    density_range: [1, count],
    histogram: { lo: 0, hi: top, counts: Array.from({ length: 256 }, (_, i) => (top > 255 ? 1000 : i === 5 ? 0 : 100 * i)) },
  };
  return { ...volume, ...channel, id, name: `${id} of the mock`, channels: [channel], default_view: { ...volume.default_view, range: [1, count], tf } };
}
