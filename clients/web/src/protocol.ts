// SPDX-License-Identifier: Apache-2.0
// WebSocket protocol blockwalk.v1: the messages of both directions, and the checks of what comes in.
//
// Binary frame, byte by byte:  0  u32 little endian  length n of the header
//                              4  n bytes            JSON header
//                            4+n  the rest           the encoded image

import { FormatError, Fields, parseJson } from "./json_fields";
import type { Members } from "./members";
import type { Vec3 } from "./vector";
import { parseVolumeInfo, type Range, type VolumeInfo } from "./volume_info";

export const kSubprotocol = "blockwalk.v1";
const kMaxHeaderBytes = 65536;

export const kModes = ["blend", "first-hit", "iso", "mip", "minip", "attenuated-mip", "mean", "blocks"] as const;
export type Mode = (typeof kModes)[number];
export const kFilters = ["nearest", "linear"] as const;
export type Filter = (typeof kFilters)[number];
export const kPresets = ["auto", "grey", "viridis", "cividis", "inferno", "ct-bone", "ct-soft-tissue", "angiography"] as const;
export type Preset = (typeof kPresets)[number];

// RFC 9457, with the view member that is to blame.
export interface Problem {
  readonly title: string;
  readonly detail: string;
  readonly field: string | null;
}

// Each is the subtype of its MIME type. What else a view may ask for, raw, the page never does.
export const kImageFormats = ["jpeg", "png", "webp"] as const;
export type ImageFormat = (typeof kImageFormats)[number];

export interface FrameHeader {
  readonly id: number; // the newest view this frame shows
  readonly seq: number;
  readonly width: number;
  readonly height: number;
  readonly format: ImageFormat;
  readonly level: number;
  readonly final: boolean; // full resolution, will not improve
  readonly complete: boolean; // nothing is coarser because its voxels were absent
  readonly scale: number; // of the resolution asked for
  readonly samples: number; // rays a pixel so far
  readonly gpuMs: number;
  readonly reasons: readonly Reason[]; // why the picture shows nothing; none where it shows something
}

// Why a picture is empty, for people, and the members of the view that would help.
export interface Reason {
  readonly reason: string;
  readonly detail: string;
  readonly change: Readonly<Record<string, string | number>>;
}

export interface Frame {
  readonly header: FrameHeader;
  readonly payload: Uint8Array<ArrayBuffer>;
  readonly bytes: number; // of the whole message
}

export type ServerMessage =
  | { readonly kind: "hello"; readonly volume: VolumeInfo }
  | { readonly kind: "error"; readonly id: number | null; readonly problem: Problem }
  | { readonly kind: "other"; readonly type: string }; // stats, pong and what later versions add

// Members of a view that change; the names are the interface's own.
export interface ViewMembers extends Members {
  readonly size?: readonly [number, number];
  readonly eye?: Vec3;
  readonly target?: Vec3;
  readonly up?: Vec3;
  readonly fov?: number; // it and ortho replace each other
  readonly ortho?: number;
  readonly channels?: readonly number[]; // drawn, of several
  readonly range?: Range | readonly Range[]; // of several channels an item each
  readonly mode?: Mode;
  readonly iso?: number | "auto";
  readonly filter?: Filter;
  readonly lit?: boolean;
  readonly tf?: string; // of several channels an item each, separated by ;
  readonly extinction?: number;
  readonly clip?: readonly number[] | "none";
  readonly planes?: readonly (readonly number[])[] | "none";
  readonly background?: string;
}

export function viewMessage(id: number, members: ViewMembers): string {
  return JSON.stringify({ type: "view", id, ...members });
}

export function ackMessage(id: number): string {
  return JSON.stringify({ type: "ack", id });
}

export function parseMessage(text: string): ServerMessage {
  const fields = new Fields(parseJson(text, "message"), "message");
  const type = fields.string("type");
  if (type === "hello") {
    if (fields.string("version") !== kSubprotocol) throw new FormatError("hello.version", kSubprotocol);
    return { kind: "hello", volume: parseVolumeInfo(fields.value("volume")) };
  }
  if (type === "error") {
    const id = fields.has("id") ? fields.number("id") : null;
    return { kind: "error", id, problem: parseProblem(fields.object("problem")) };
  }
  return { kind: "other", type };
}

export function parseProblem(fields: Fields): Problem {
  const title = fields.has("title") ? fields.string("title") : "Something went wrong";
  return {
    title,
    detail: fields.has("detail") ? fields.string("detail") : "",
    field: fields.has("field") ? fields.string("field") : null,
  };
}

// Of the body of a refusal; what is none, a proxy's say, is its own detail.
export function problemIn(body: string, title: string): Problem {
  try {
    return parseProblem(new Fields(parseJson(body, "problem"), "problem"));
  } catch (error) {
    if (!(error instanceof FormatError)) throw error;
    return { title, detail: body.slice(0, 200), field: null };
  }
}

export function parseFrame(message: ArrayBuffer): Frame {
  if (message.byteLength < 4) throw new FormatError("frame", "a header length of 4 bytes");
  const headerBytes = new DataView(message).getUint32(0, true);
  if (headerBytes > kMaxHeaderBytes || 4 + headerBytes >= message.byteLength) {
    throw new FormatError("frame", `a header and an image in ${message.byteLength} bytes, header says ${headerBytes}`);
  }
  const text = new TextDecoder("utf-8", { fatal: false }).decode(new Uint8Array(message, 4, headerBytes));
  return {
    header: parseHeader(parseJson(text, "frame.header")),
    payload: new Uint8Array(message, 4 + headerBytes),
    bytes: message.byteLength,
  };
}

function parseHeader(value: unknown): FrameHeader {
  const fields = new Fields(value, "frame");
  const name = fields.string("format");
  const format = kImageFormats.find((known) => known === name);
  if (format === undefined) throw new FormatError("frame.format", kImageFormats.join(" or "));
  return {
    id: fields.number("id"),
    seq: fields.number("seq"),
    width: fields.number("width"),
    height: fields.number("height"),
    format,
    level: fields.number("level"),
    final: fields.boolean("final"),
    complete: fields.has("complete") ? fields.boolean("complete") : true,
    scale: fields.number("scale"),
    samples: fields.has("samples") ? fields.number("samples") : 1,
    gpuMs: fields.number("gpu_ms"),
    reasons: fields.has("reasons") ? fields.array("reasons").map(parseReason) : [],
  };
}

function parseReason(value: unknown, index: number): Reason {
  const fields = new Fields(value, `frame.reasons[${index}]`);
  const change = Object.entries(fields.value("change") ?? {}).flatMap(([name, member]: [string, unknown]) =>
    typeof member === "string" || typeof member === "number" ? [[name, member] as const] : []);
  return { reason: fields.string("reason"), detail: fields.string("detail"), change: Object.fromEntries(change) };
}
