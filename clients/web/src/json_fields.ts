// SPDX-License-Identifier: Apache-2.0
// Typed reading of JSON that came over the wire. Every failure is a FormatError that names the member.

import type { Vec3 } from "./vector";

export class FormatError extends Error {
  override readonly name = "FormatError";
  constructor(readonly field: string, expected: string) {
    super(`${field}: expected ${expected}`);
  }
}

export class Fields {
  private readonly members: ReadonlyMap<string, unknown>;

  // `path` names the object in errors: "volume", "volume.histogram".
  constructor(value: unknown, readonly path: string) {
    if (typeof value !== "object" || value === null || Array.isArray(value)) throw new FormatError(path, "an object");
    this.members = new Map(Object.entries(value));
  }

  has(name: string): boolean {
    const value = this.members.get(name);
    return value !== undefined && value !== null;
  }

  value(name: string): unknown {
    return this.members.get(name);
  }

  object(name: string): Fields {
    return new Fields(this.members.get(name), this.at(name));
  }

  string(name: string): string {
    const value = this.members.get(name);
    if (typeof value !== "string") throw new FormatError(this.at(name), "a string");
    return value;
  }

  number(name: string): number {
    const value = this.members.get(name);
    if (!isFiniteNumber(value)) throw new FormatError(this.at(name), "a finite number");
    return value;
  }

  boolean(name: string): boolean {
    const value = this.members.get(name);
    if (typeof value !== "boolean") throw new FormatError(this.at(name), "true or false");
    return value;
  }

  array(name: string): readonly unknown[] {
    const value = this.members.get(name);
    if (!Array.isArray(value)) throw new FormatError(this.at(name), "an array");
    return value;
  }

  numbers(name: string, count?: number): readonly number[] {
    const values = this.array(name);
    if (!values.every(isFiniteNumber) || (count !== undefined && values.length !== count)) {
      throw new FormatError(this.at(name), count === undefined ? "finite numbers" : `${count} finite numbers`);
    }
    return values;
  }

  vec3(name: string): Vec3 {
    const [x = 0, y = 0, z = 0] = this.numbers(name, 3);
    return [x, y, z];
  }

  pair(name: string): readonly [number, number] {
    const [a = 0, b = 0] = this.numbers(name, 2);
    return [a, b];
  }

  private at(name: string): string {
    return `${this.path}.${name}`;
  }
}

function isFiniteNumber(value: unknown): value is number {
  return typeof value === "number" && Number.isFinite(value);
}

// JSON text as a value of unknown shape; text that is not JSON is a FormatError.
export function parseJson(text: string, path: string): unknown {
  try {
    const value: unknown = JSON.parse(text);
    return value;
  } catch {
    throw new FormatError(path, "JSON");
  }
}
