// SPDX-License-Identifier: Apache-2.0
// What is cut away by a box of the world: between two thumbs along each axis, a voxel a step, or by handles on its faces in
// the picture. Planes have a list of their own.

import { byId, part } from "./dom";
import { FaceHandles } from "./face_handles";
import { positionOf, type ValueScale } from "./histogram_shape";
import { PlaneList } from "./plane_list";
import { formatLength } from "./projection";
import { bindThumb, percent } from "./thumb";
import { formatIn } from "./units";
import type { Vec3 } from "./vector";
import type { Viewport } from "./camera";
import type { Box, ViewChange, ViewState } from "./view_state";
import type { VolumeInfo } from "./volume_info";
import { voxelAxis, voxelRange } from "./voxel_axes";

const kAxes = [0, 1, 2] as const;
export type Axis = (typeof kAxes)[number];
export type End = "min" | "max";

interface AxisRow {
  readonly scale: ValueScale;
  readonly band: HTMLElement;
  readonly thumbs: Readonly<Record<End, HTMLElement>>;
  readonly output: HTMLElement;
}

export class CutControl {
  private readonly rows = byId("cut-rows", HTMLElement);
  private readonly template = byId("cut-row", HTMLTemplateElement);
  private readonly reset = byId("cut-reset", HTMLButtonElement);
  private readonly wantsHandles = byId("cut-handles", HTMLInputElement);
  private readonly planes: PlaneList;
  private readonly handles = new FaceHandles((axis, end, value) => this.move(axis, end, value));
  private axes: readonly AxisRow[] = [];
  private volume: VolumeInfo | null = null;
  private view: ViewState | null = null;

  // `forward` is where the camera looks.
  constructor(private readonly onChange: (change: ViewChange) => void, forward: () => Vec3 | null) {
    this.planes = new PlaneList((planes) => onChange({ planes }), forward);
    this.reset.addEventListener("click", () => onChange({ clip: null, planes: [] }));
  }

  setVolume(volume: VolumeInfo): void {
    this.volume = volume;
    this.view = null;
    this.planes.setVolume(volume);
    this.rows.replaceChildren();
    this.axes = kAxes.map((axis) => this.row(axis, volume));
  }

  show(view: ViewState): void {
    this.view = view;
    const { volume } = this;
    const box = view.clip ?? volume?.worldBox;
    if (box === undefined || volume === null) return;
    this.axes.forEach((row, i) => showRow(row, kAxes[i] ?? 0, box, volume));
    this.planes.show(view.planes);
    this.reset.disabled = view.clip === null && view.planes.length === 0;
  }

  // A frame shows this view.
  frameShown(view: ViewState, viewport: Viewport): void {
    this.handles.show(view.clip ?? this.volume?.worldBox ?? null, view, viewport);
  }

  private row(axis: Axis, volume: VolumeInfo): AxisRow {
    const copy = this.template.content.cloneNode(true);
    if (!(copy instanceof DocumentFragment)) throw new Error("a template's copy is a fragment");
    const [lo, hi] = [volume.worldBox.min[axis], volume.worldBox.max[axis]];
    const scale = { lo, hi, step: voxelAxis(volume, axis).step };
    const name = "xyz"[axis] ?? "";
    part(copy, ".cut-name", HTMLElement).textContent = name;
    const track = part(copy, ".cut-track", HTMLElement);
    const thumbs = { min: part(copy, ".thumb.lo", HTMLElement), max: part(copy, ".thumb.hi", HTMLElement) };
    for (const end of ["min", "max"] as const) {
      thumbs[end].setAttribute("aria-label", `${end === "min" ? "From" : "To"} ${name}`);
      bindThumb(thumbs[end], track, scale, {
        value: () => (this.view?.clip ?? volume.worldBox)[end][axis],
        move: (value) => {
          this.wantsHandles.checked = true; // who cuts by sliders is shown that faces can be dragged
          this.move(axis, end, value);
        },
        taken: () => Object.values(thumbs).forEach((other) => other.classList.toggle("front", other === thumbs[end])),
      });
    }
    this.rows.append(copy);
    const made = this.rows.lastElementChild ?? this.rows;
    return { scale, band: part(made, ".cut-band", HTMLElement), thumbs, output: part(made, ".cut-output", HTMLElement) };
  }

  // On the faces of voxels, and a voxel before the other side at least. A box that is the whole volume's is none.
  private move(axis: Axis, end: End, value: number): void {
    if (this.volume === null || this.view === null) return;
    const whole = this.volume.worldBox;
    const box = this.view.clip ?? whole;
    const { step } = voxelAxis(this.volume, axis);
    const [lo, hi] = [whole.min[axis], whole.max[axis]];
    const onFace = hi - value < step / 2 ? hi : Number((lo + Math.round((value - lo) / step) * step).toPrecision(12));
    const inside = Math.max(lo, Math.min(hi, onFace));
    const bound = end === "min" ? Math.max(lo, Math.min(inside, box.max[axis] - step)) : Math.min(hi, Math.max(inside, box.min[axis] + step));
    const side = (other: Axis): number => (other === axis ? bound : box[end][other]);
    const clip: Box = { ...box, [end]: [side(0), side(1), side(2)] };
    const isWhole = kAxes.every((a) => clip.min[a] <= whole.min[a] && clip.max[a] >= whole.max[a]);
    this.onChange({ clip: isWhole ? null : clip });
  }
}

function showRow({ scale, band, thumbs, output }: AxisRow, axis: Axis, box: Box, volume: VolumeInfo): void {
  const [lo, hi] = [box.min[axis], box.max[axis]];
  const voxels = voxelRange(volume, axis, [lo, hi]);
  const { isReversed } = voxelAxis(volume, axis);
  const inUnit = (value: number): string => `${formatIn(value, scale.hi - scale.lo)}${volume.lengthUnit === null ? "" : ` ${volume.lengthUnit}`}`;
  for (const end of ["min", "max"] as const) {
    const own = end === "min" ? lo : hi;
    const voxel = voxels === null ? null : voxels[(end === "min") !== isReversed ? 0 : 1];
    thumbs[end].style.left = percent(positionOf(scale, own));
    thumbs[end].setAttribute("aria-valuemin", String(end === "min" ? scale.lo : lo));
    thumbs[end].setAttribute("aria-valuemax", String(end === "min" ? hi : scale.hi));
    thumbs[end].setAttribute("aria-valuenow", String(own));
    thumbs[end].setAttribute("aria-valuetext", voxel === null ? inUnit(own) : `voxel ${voxel}, ${inUnit(own)}`);
  }
  band.style.left = percent(positionOf(scale, lo));
  band.style.right = percent(1 - positionOf(scale, hi));
  const size = formatLength(hi - lo, volume.lengthUnit);
  output.textContent = voxels === null ? `${formatIn(lo, scale.hi - scale.lo)} – ${formatIn(hi, scale.hi - scale.lo)}` : `${voxels[0]} – ${voxels[1]}`;
  output.title = `${voxels === null ? "The voxels lie obliquely: world" : "Voxels; world"} ${inUnit(lo)} to ${inUnit(hi)}, ${size} long`;
  output.dataset["length"] = size;
}
