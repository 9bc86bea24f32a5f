// SPDX-License-Identifier: Apache-2.0
// A server that speaks the protocol and draws a shaded ball instead of a volume: it turns with the eye, and shrinks
// with the lower bound of the first range; its colour is that of the first channel drawn. It sends a coarse frame at once and the final one a little later.

import { readFile } from "node:fs/promises";
import { createServer, type IncomingMessage, type Server, type ServerResponse } from "node:http";
import type { AddressInfo } from "node:net";
import { extname, join } from "node:path";
import { WebSocketServer, type WebSocket } from "ws";
import { encodePng } from "./png";
import { sampleVolume } from "./sample_volume";

type View = Record<string, unknown>;

const kTypes: Readonly<Record<string, string>> = {
  ".html": "text/html; charset=utf-8", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml",
};
const kFinalAfterMs = 120;

export interface ListedVolume {
  readonly id: string;
  readonly state: "ready" | "loading" | "failed";
  readonly type: string;
  readonly channelNames?: readonly string[];
  readonly error?: string;
}

export class MockServer {
  volumes: readonly ListedVolume[];
  readonly views: View[] = []; // every view message, as it came
  readonly acks: number[] = [];
  refusal: { readonly status: number; readonly title: string; readonly detail: string } | null = null; // of every stream
  attempts = 0; // at a stream
  refusedMember: string | null = null; // views that have it are refused for it
  private readonly http: Server;
  private readonly sockets = new WebSocketServer({ noServer: true, handleProtocols: () => "blockwalk.v1" });

  constructor(private readonly pageFolder: string, volumes: readonly ListedVolume[]) {
    this.volumes = volumes;
    this.http = createServer((request, response) => void this.answer(request, response));
    this.http.on("upgrade", (request, socket, head) => {
      ++this.attempts;
      if (this.refusal !== null) return void socket.end(`HTTP/1.1 ${this.refusal.status} Refused\r\nContent-Length: 0\r\n\r\n`);
      const id = /^\/api\/v1\/volumes\/([^/]+)\/stream$/.exec(request.url ?? "")?.[1];
      const volume = this.volumes.find((listed) => listed.id === decodeURIComponent(id ?? ""));
      if (volume?.state !== "ready") return void socket.end("HTTP/1.1 503 Service Unavailable\r\n\r\n");
      this.sockets.handleUpgrade(request, socket, head, (webSocket) => this.serve(webSocket, volume));
    });
  }

  // Listens on a port, 0 for a free one, and returns it.
  async start(port = 0): Promise<number> {
    await new Promise<void>((resolve) => this.http.listen(port, "127.0.0.1", resolve));
    const address: AddressInfo | string | null = this.http.address();
    if (address === null || typeof address === "string") throw new Error("the mock has no port");
    return address.port;
  }

  // Ends at once, as a killed process does.
  async stop(): Promise<void> {
    for (const socket of this.sockets.clients) socket.terminate();
    this.http.closeAllConnections();
    await new Promise((resolve) => this.http.close(resolve));
  }

  private async answer(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const path = new URL(request.url ?? "/", "http://mock").pathname;
    if (path === "/api/v1/volumes") {
      const volumes = this.volumes.map((listed) => (listed.state === "ready" ? { ...sampleVolume(listed.id, listed.type, listed.channelNames), ...listed } : { name: listed.id, ...listed }));
      return void response.writeHead(200, { "content-type": "application/json" }).end(JSON.stringify({ volumes }));
    }
    if (path.endsWith("/stream") && this.refusal !== null) {
      const problem = { type: "about:blank", ...this.refusal };
      return void response.writeHead(this.refusal.status, { "content-type": "application/problem+json" }).end(JSON.stringify(problem));
    }
    const file = path === "/" ? "/index.html" : path;
    const type = kTypes[extname(file)];
    if (type === undefined || file.includes("..")) return void response.writeHead(404).end();
    const body = await readFile(join(this.pageFolder, file)).catch(() => null);
    if (body === null) return void response.writeHead(404).end();
    response.writeHead(200, { "content-type": type, "content-security-policy": "default-src 'self'; img-src 'self' data:" }).end(body);
  }

  private serve(socket: WebSocket, listed: ListedVolume): void {
    const hello = { type: "hello", version: "blockwalk.v1", volume: sampleVolume(listed.id, listed.type, listed.channelNames), limits: {} };
    socket.send(JSON.stringify(hello));
    let view: View = {};
    let seq = 0;
    let final: NodeJS.Timeout | undefined;
    socket.on("message", (data) => {
      const message: View = JSON.parse(String(data)) as View;
      if (message["type"] === "ack") this.acks.push(Number(message["id"]));
      if (message["type"] !== "view") return;
      this.views.push(message);
      if (message["extinction"] !== undefined && listed.type !== "rgba8") {
        const problem = { type: "about:blank", title: "Bad Request", status: 400, detail: "extinction: only rgba8 has one", field: "extinction" };
        return socket.send(JSON.stringify({ type: "error", id: message["id"], problem }));
      }
      const refused = this.refusedMember;
      if (refused !== null && message[refused] !== undefined) {
        const problem = { type: "about:blank", title: "Bad Request", status: 400, detail: `${refused}: not today`, field: refused };
        return socket.send(JSON.stringify({ type: "error", id: message["id"], problem }));
      }
      view = { ...view, ...message };
      socket.send(drawFrame(view, ++seq, 0.25));
      clearTimeout(final);
      final = setTimeout(() => socket.send(drawFrame(view, ++seq, 1)), kFinalAfterMs);
    });
    socket.on("close", () => clearTimeout(final));
  }

  // Sends one text message to every page.
  tell(message: object): void {
    for (const socket of this.sockets.clients) socket.send(JSON.stringify(message));
  }

  // Sends an image of one pixel to every page, as the final frame of the newest view.
  tellFrame(format: string, image: Buffer): void {
    const header = {
      id: this.views.at(-1)?.["id"], seq: 1000, width: 1, height: 1, format, level: 0, final: true, scale: 1, gpu_ms: 1, encode_ms: 1, dropped: 0,
    };
    for (const socket of this.sockets.clients) socket.send(frameMessage(header, image));
  }
}

function numbers(value: unknown): number[] {
  return Array.isArray(value) ? value.map(Number) : [];
}

// The final frame is at most 320 pixels wide too: drawing in JavaScript is slow, and the page scales it.
function drawFrame(view: View, seq: number, scale: number): Buffer {
  const [fullWidth = 1, fullHeight = 1] = numbers(view["size"]);
  const shrink = scale * Math.min(1, 320 / fullWidth);
  const width = Math.max(1, Math.round(fullWidth * shrink));
  const height = Math.max(1, Math.round(fullHeight * shrink));
  const [ex = 0, ey = 0, ez = 1] = numbers(view["eye"]).map((e, i) => e - (numbers(view["target"])[i] ?? 0));
  const range: unknown = view["range"];
  const [lo = 0] = numbers(Array.isArray(range) && Array.isArray(range[0]) ? range[0] : range);
  const [first = 0] = numbers(view["channels"]);
  const background = parseInt(String(view["background"]), 16);
  const yaw = Math.atan2(ex, ez);
  const pitch = Math.atan2(ey, Math.hypot(ex, ez));
  const radius = (0.42 - 0.3 * ((lo - 10) / 240)) * (340 / Math.max(1, Math.hypot(ex, ey, ez)));
  const image = encodePng(width, height, (px, py) => {
    const x = (px + 0.5 - width / 2) / height / radius;
    const y = (height / 2 - py - 0.5) / height / radius;
    const d = x * x + y * y;
    if (d >= 1) return [background >> 16, (background >> 8) & 255, background & 255];
    const z = Math.sqrt(1 - d);
    const band = Math.sin(8 * (Math.atan2(x, z) + yaw)) * Math.sin(8 * (Math.asin(y) + pitch)) > 0 ? 1 : 0.6;
    const light = (0.25 + 0.75 * Math.max(0, 0.4 * x + 0.5 * y + 0.75 * z)) * band;
    const tint = ([[255, 190, 120], [120, 190, 255], [190, 255, 120]] as const)[first % 3] ?? [255, 255, 255];
    return [tint[0] * light, tint[1] * light, tint[2] * light];
  });
  const header = {
    id: view["id"], seq, width, height, format: "png", level: scale < 1 ? 1 : 0, final: scale === 1, scale, gpu_ms: 3.2, encode_ms: 1, dropped: 0,
  };
  return frameMessage(header, image);
}

function frameMessage(header: object, image: Buffer): Buffer {
  const text = Buffer.from(JSON.stringify(header));
  const length = Buffer.alloc(4);
  length.writeUInt32LE(text.length);
  return Buffer.concat([length, text, image]);
}
