// SPDX-License-Identifier: Apache-2.0
// What lies under the pointer on a slice: the voxel, its place and its values, as the file has them. One voxel is asked for
// once the pointer rests, one question at a time.

import { byId } from "./dom";
import { Fields, FormatError, parseJson } from "./json_fields";
import { pickText } from "./probe";
import type { Vec3 } from "./vector";
import type { VolumeInfo } from "./volume_info";

const kRestMs = 90;
const kTimeoutMs = 5000;

export class SliceProbe {
  private readonly text = byId("probe", HTMLElement);
  private timer: number | undefined;
  private question: AbortController | null = null;
  private asked = "";

  // `address`: of a query of the volume's region.
  constructor(private readonly address: (query: string) => string) {}

  // `time`: the step, as the address has it.
  rest(volume: VolumeInfo, voxel: Vec3, world: Vec3, time: string | undefined): void {
    const query = voxelQuery(voxel, time);
    if (query === this.asked && !this.text.hidden) return;
    this.leave();
    this.asked = query;
    this.timer = window.setTimeout(() => void this.ask(volume, voxel, world, query), kRestMs);
  }

  leave(): void {
    window.clearTimeout(this.timer);
    this.question?.abort();
    this.asked = "";
    this.text.hidden = true;
  }

  private async ask(volume: VolumeInfo, voxel: Vec3, world: Vec3, query: string): Promise<void> {
    const question = new AbortController();
    this.question = question;
    try {
      const response = await fetch(this.address(query), { signal: AbortSignal.any([question.signal, AbortSignal.timeout(kTimeoutMs)]) });
      if (!response.ok || question.signal.aborted) return;
      const values = valuesOf(response.headers.get("x-blockwalk-raw"), await response.arrayBuffer(), volume);
      if (question.signal.aborted) return;
      this.text.textContent = pickText({ voxel, world, values }, volume);
      this.text.hidden = false;
    } catch (error) {
      const isNone = error instanceof DOMException || error instanceof TypeError || error instanceof FormatError; // too late, or away
      if (!isNone) throw error;
    }
  }
}

export function voxelQuery(voxel: Vec3, time: string | undefined): string {
  return [`format=raw&level=0&box=${[...voxel, ...voxel.map((part) => part + 1)].join(",")}`, ...(time === undefined ? [] : [`time=${time}`])].join("&");
}

const kReaders: Readonly<Record<string, readonly [bytes: number, read: (view: DataView, at: number) => number]>> = {
  u8: [1, (view, at) => view.getUint8(at)],
  i8: [1, (view, at) => view.getInt8(at)],
  u16: [2, (view, at) => view.getUint16(at, true)],
  i16: [2, (view, at) => view.getInt16(at, true)],
  f32: [4, (view, at) => view.getFloat32(at, true)],
  rgba8: [1, (view, at) => view.getUint8(at)], // four of them
};

// Of one voxel, a value a channel in data units; of colours red, green, blue and opacity. Signed ones are data values as they come.
export function valuesOf(header: string | null, bytes: ArrayBuffer, { channels }: Pick<VolumeInfo, "channels">): readonly number[] {
  const fields = new Fields(parseJson(header ?? "", "X-Blockwalk-Raw"), "X-Blockwalk-Raw");
  const type = fields.string("type");
  const reader = kReaders[type];
  if (reader === undefined) throw new FormatError("X-Blockwalk-Raw.type", `one of ${Object.keys(kReaders).join(", ")}`);
  const [size, read] = reader;
  const count = type === "rgba8" ? 4 : fields.number("channels");
  if (bytes.byteLength !== size * count) throw new FormatError("X-Blockwalk-Raw", `${size * count} bytes`);
  const view = new DataView(bytes);
  return Array.from({ length: count }, (_, i) => {
    const [stored, channel] = [read(view, i * size), channels[i]];
    return channel === undefined || type === "rgba8" || type.startsWith("i") ? stored : stored * channel.valueScale + channel.valueOffset;
  });
}
