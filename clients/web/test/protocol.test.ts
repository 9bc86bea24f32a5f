// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { FormatError } from "../src/json_fields";
import { ackMessage, parseFrame, parseMessage, viewMessage } from "../src/protocol";
import { parseVolumeInfo, parseVolumeList } from "../src/volume_info";
import { sampleVolume } from "./sample_volume";

const kHeader = { id: 7, seq: 3, width: 4, height: 2, format: "png", level: 0, final: true, scale: 1, gpu_ms: 2.5, encode_ms: 1, dropped: 0 };

function frameBytes(header: unknown, payload: readonly number[], claimedLength?: number): ArrayBuffer {
  const text = new TextEncoder().encode(JSON.stringify(header));
  const message = new Uint8Array(4 + text.length + payload.length);
  new DataView(message.buffer).setUint32(0, claimedLength ?? text.length, true);
  message.set(text, 4);
  message.set(payload, 4 + text.length);
  return message.buffer;
}

const faultAt = (field: string) => (error: unknown): boolean => error instanceof FormatError && error.field === field;

test("a frame gives its header and payload", () => {
  const frame = parseFrame(frameBytes(kHeader, [1, 2, 3]));
  assert.deepEqual([...frame.payload], [1, 2, 3]);
  assert.equal(frame.header.id, 7);
  assert.equal(frame.header.gpuMs, 2.5);
  assert.equal(frame.header.final, true);
  assert.equal(frame.bytes, 4 + JSON.stringify(kHeader).length + 3);
});

test("every truncated frame is refused, never read past its end", () => {
  const whole = new Uint8Array(frameBytes(kHeader, [1]));
  for (let n = 0; n < whole.length; n++) {
    assert.throws(() => parseFrame(whole.slice(0, n).buffer), FormatError, `${n} bytes`);
  }
});

test("a frame whose header length lies is refused", () => {
  for (const length of [0, 1, 1000, 0xffffffff]) {
    assert.throws(() => parseFrame(frameBytes(kHeader, [1, 2, 3], length)), FormatError, `length ${length}`);
  }
});

test("a header member that is missing or of another type is named", () => {
  for (const name of ["id", "seq", "width", "height", "level", "scale", "gpu_ms", "final", "format"]) {
    assert.throws(() => parseFrame(frameBytes({ ...kHeader, [name]: undefined }, [1])), faultAt(`frame.${name}`));
    assert.throws(() => parseFrame(frameBytes({ ...kHeader, [name]: [1] }, [1])), faultAt(`frame.${name}`));
  }
  assert.throws(() => parseFrame(frameBytes({ ...kHeader, format: "svg+xml" }, [1])), faultAt("frame.format"));
});

test("a frame's format is the subtype of its MIME type", () => {
  for (const format of ["jpeg", "png", "webp"]) {
    assert.equal(parseFrame(frameBytes({ ...kHeader, format }, [1])).header.format, format);
  }
});

test("hello carries the volume", () => {
  const volume = sampleVolume("fossil", "rgba8");
  const message = parseMessage(JSON.stringify({ type: "hello", version: "blockwalk.v1", volume, limits: {} }));
  assert.ok(message.kind === "hello");
  assert.equal(message.volume.type, "rgba8");
  assert.deepEqual(message.volume.worldBox.max, [96, 80, 128]);
  assert.equal(message.volume.blockCount, 12);
});

test("hello of another version is refused", () => {
  const text = JSON.stringify({ type: "hello", version: "blockwalk.v2", volume: sampleVolume("a", "u8"), limits: {} });
  assert.throws(() => parseMessage(text), faultAt("hello.version"));
});

test("an error carries the problem document", () => {
  const problem = { type: "about:blank", title: "Bad Request", status: 400, detail: "range: lo above hi", field: "range" };
  assert.deepEqual(parseMessage(JSON.stringify({ type: "error", id: 4, problem })), {
    kind: "error", id: 4, problem: { title: "Bad Request", detail: "range: lo above hi", field: "range" },
  });
});

test("messages of later versions pass, what is no message does not", () => {
  assert.deepEqual(parseMessage('{"type":"stats","stats":{}}'), { kind: "other", type: "stats" });
  for (const text of ["", "[]", "null", "{", '{"type":3}', "{}"]) assert.throws(() => parseMessage(text), FormatError, text);
});

test("a volume's broken member is named", () => {
  const volume = sampleVolume("a", "u8");
  assert.throws(() => parseVolumeInfo({ ...volume, type: "rgb" }), faultAt("volume.type"));
  assert.throws(() => parseVolumeInfo({ ...volume, dims: [1, 2] }), faultAt("volume.dims"));
  assert.throws(() => parseVolumeInfo({ ...volume, levels: [] }), faultAt("volume.levels[0]"));
  assert.throws(() => parseVolumeInfo({ ...volume, default_view: { ...volume.default_view, eye: ["0", 0, 0] } }), faultAt("volume.default_view.eye"));
});

test("each channel has its name, range and colour", () => {
  const parsed = parseVolumeInfo(sampleVolume("a", "u16", ["nuclei", ""]));
  assert.deepEqual(parsed.channels.map(({ name, colour, defaultRange, densityRange }) => ({ name, colour, defaultRange, densityRange })), [
    { name: "nuclei", colour: "00ff00", defaultRange: [10, 250], densityRange: [10, 250] },
    { name: "Channel 2", colour: "ff00ff", defaultRange: [1010, 1250], densityRange: [1010, 1250] },
  ]);
  assert.equal(parseVolumeInfo(sampleVolume("a", "u8")).channels[0]?.colour, "00ff00");
  assert.equal(parseVolumeInfo(sampleVolume("a", "rgba8")).channels[0]?.colour, null);
});

test("a channel's broken member is named", () => {
  for (const names of [["one"], ["one", "two"]]) {
    const volume = sampleVolume("a", "u16", names);
    const viewed = (member: object) => ({ ...volume, default_view: { ...volume.default_view, ...member } });
    for (const range of [[[5], [1, 2]], [5], [], [null, [1, 2]], [[1, 2]], undefined]) {
      assert.throws(() => parseVolumeInfo(viewed({ range })), faultAt("volume.default_view.range"));
    }
    for (const tf of ["1:00ff00", ["1:00ff00:1"], [null, "1:00ff00:1"], ["viridis", "1:00ff00:1"], 3]) {
      assert.throws(() => parseVolumeInfo(viewed({ tf })), faultAt("volume.default_view.tf"), JSON.stringify(tf));
    }
    assert.throws(() => parseVolumeInfo({ ...volume, channels: [] }), faultAt("volume.channels"));
    assert.throws(() => parseVolumeInfo({ ...volume, channels: volume.channels.map((c) => ({ ...c, name: 3 })) }), faultAt("volume.channels[0].name"));
  }
});

test("the list knows volumes that are not ready", () => {
  const list = parseVolumeList({ volumes: [
    { ...sampleVolume("a", "u16"), state: "ready" },
    { id: "b", name: "b", state: "loading" },
    { id: "c", name: "c", state: "failed", error: "c.bwv: chunk 3: wrong checksum" },
  ] });
  assert.deepEqual(list.map((volume) => volume.state), ["ready", "loading", "failed"]);
  assert.equal(list[2]?.error, "c.bwv: chunk 3: wrong checksum");
  assert.equal(list[1]?.dims, null);
  assert.throws(() => parseVolumeList({ volumes: [{ id: "a", name: "a", state: "gone" }] }), faultAt("volumes[0].state"));
});

test("messages have the interface's form", () => {
  assert.equal(viewMessage(2, { size: [8, 4], mode: "first-hit" }), '{"type":"view","id":2,"size":[8,4],"mode":"first-hit"}');
  assert.equal(ackMessage(2), '{"type":"ack","id":2}');
});
