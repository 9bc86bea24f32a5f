// SPDX-License-Identifier: Apache-2.0
// Animations of the mock: a zip of stored entries, without checksums, that comes frame by frame, and what can go wrong with one.

import type { IncomingMessage, ServerResponse } from "node:http";
import { encodePng } from "./png";

export class MockAnimations {
  readonly asked: unknown[] = []; // bodies
  stopAt: number | null = null; // no more frames come from this one on
  breakAt: number | null = null; // the connection breaks at this one
  refusal: { readonly status: number; readonly detail: string; readonly field?: string } | null = null;
  abandoned = 0;

  async answer(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const parts: Buffer[] = [];
    for await (const part of request) parts.push(part as Buffer);
    const body = JSON.parse(Buffer.concat(parts).toString()) as { frames: number; format: string };
    this.asked.push(body);
    response.on("close", () => {
      if (!response.writableFinished) ++this.abandoned;
    });
    if (this.refusal !== null) {
      const problem = { type: "about:blank", title: "Refused", ...this.refusal };
      return void response.writeHead(this.refusal.status, { "content-type": "application/problem+json" }).end(JSON.stringify(problem));
    }
    if (body.format === "webp") return void response.writeHead(200, { "content-type": "image/webp" }).end("RIFF");
    response.writeHead(200, { "content-type": "application/zip" });
    const zip = new StoredZip();
    for (let i = 0; i < body.frames; i++) {
      if (i === this.stopAt) return;
      if (i === this.breakAt) return void response.destroy();
      const entry = zip.entry(`frame${String(i).padStart(4, "0")}.png`, encodePng(8, 6, () => [i, 0, 0]));
      // Pieces end anywhere.
      response.write(entry.subarray(0, 17));
      await new Promise((resolve) => setTimeout(resolve, 5));
      response.write(entry.subarray(17));
    }
    response.end(zip.end());
  }
}

export class StoredZip {
  private offset = 0;
  private readonly directory: Buffer[] = [];

  entry(name: string, bytes: Buffer): Buffer {
    const fields = Buffer.alloc(26);
    fields.writeUInt16LE(20, 0);
    fields.writeUInt32LE(bytes.length, 14);
    fields.writeUInt32LE(bytes.length, 18);
    fields.writeUInt16LE(name.length, 22);
    const place = Buffer.alloc(14);
    place.writeUInt32LE(this.offset, 10);
    this.directory.push(Buffer.from("PK\x01\x02\x14\x00", "latin1"), fields, place, Buffer.from(name));
    const whole = Buffer.concat([Buffer.from("PK\x03\x04", "latin1"), fields, Buffer.from(name), bytes]);
    this.offset += whole.length;
    return whole;
  }

  end(): Buffer {
    const directory = Buffer.concat(this.directory);
    const end = Buffer.alloc(22);
    end.write("PK\x05\x06", 0, "latin1");
    end.writeUInt16LE(this.directory.length / 4, 8);
    end.writeUInt16LE(this.directory.length / 4, 10);
    end.writeUInt32LE(directory.length, 12);
    end.writeUInt32LE(this.offset, 16);
    return Buffer.concat([directory, end]);
  }
}
