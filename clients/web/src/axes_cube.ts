// SPDX-License-Identifier: Apache-2.0
// A small cube that turns with the picture. Each face in sight is a button: the standard view from its side.

import { basisOf } from "./camera";
import { sidesOf, type Side } from "./axes";
import { byId } from "./dom";
import { add, cross, dot, scale, type Vec3 } from "./vector";
import type { ViewState } from "./view_state";
import type { VolumeInfo } from "./volume_info";

const kSvg = "http://www.w3.org/2000/svg";
const kHalf = 23; // of the cube's side, pixels
const kLeastSeen = 0.06; // of a face: narrower ones cannot be hit

interface Face {
  readonly side: Side;
  readonly group: SVGGElement;
  readonly shape: SVGPolygonElement;
  readonly text: SVGTextElement;
}

export class AxesCube {
  private readonly root = byId("axes", SVGSVGElement);
  private faces: readonly Face[] = [];

  constructor(private readonly onChoose: (forward: Vec3, up: Vec3) => void) {}

  setVolume({ space, defaultView }: VolumeInfo): void {
    this.faces = sidesOf(space, defaultView.camera.up).map((side) => this.face(side));
    this.root.replaceChildren(...this.faces.map(({ group }) => group));
  }

  // The sides in their order, for keys.
  choose(number: number): void {
    const side = this.faces[number]?.side;
    if (side !== undefined) this.onChoose(scale(side.direction, -1), side.up);
  }

  show(view: ViewState): void {
    const { right, up, forward } = basisOf(view.camera);
    const flat = (point: Vec3): readonly [number, number] => [kHalf * dot(point, right), -kHalf * dot(point, up)];
    for (const { side, group, shape, text } of this.faces) {
      const seen = -dot(side.direction, forward);
      const isSeen = seen > kLeastSeen;
      group.setAttribute("visibility", isSeen ? "visible" : "hidden");
      group.setAttribute("tabindex", isSeen ? "0" : "-1");
      if (!isSeen) continue;
      // The face's own right and up, as its letter stands on it.
      const across = cross(side.up, side.direction);
      const corners = ([[-1, -1], [1, -1], [1, 1], [-1, 1]] as const).map(([a, b]) => flat(add(side.direction, add(scale(across, a), scale(side.up, b)))));
      shape.setAttribute("points", corners.map((corner) => corner.map((part) => part.toFixed(1)).join()).join(" "));
      shape.style.fill = `hsl(212 16% ${Math.round(20 + 16 * seen)}%)`;
      const [x, y] = flat(side.direction);
      const [ax, ay] = flat(across);
      const [ux, uy] = flat(side.up);
      // The letter lies on the face, and of the four ways to lie the way up.
      const ways = [[ax, ay, ux, uy], [-ux, -uy, ax, ay], [-ax, -ay, -ux, -uy], [ux, uy, -ax, -ay]] as const;
      const [rx, ry, tx, ty] = ways.reduce((best, way) => (way[3] < best[3] ? way : best));
      text.setAttribute("transform", `matrix(${[rx / kHalf, ry / kHalf, -tx / kHalf, -ty / kHalf, x, y].map((part) => part.toFixed(3)).join(" ")})`);
    }
  }

  private face(side: Side): Face {
    const [group, shape, text, title] = [
      document.createElementNS(kSvg, "g"), document.createElementNS(kSvg, "polygon"), document.createElementNS(kSvg, "text"), document.createElementNS(kSvg, "title"),
    ];
    title.textContent = `Look from ${side.words}`;
    text.textContent = side.name;
    group.setAttribute("role", "button");
    group.setAttribute("aria-label", `Look from ${side.words}`);
    group.append(title, shape, text);
    const choose = (): void => this.onChoose(scale(side.direction, -1), side.up);
    group.addEventListener("click", choose);
    group.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      event.stopPropagation();
      choose();
    });
    return { side, group, shape, text };
  }
}
