// SPDX-License-Identifier: Apache-2.0
// How thick slices are, what a thick one shows, and in which colours.

import { byId } from "./dom";
import { kMostThickness, kReduces, type SliceState } from "./slice_state";
import type { VolumeInfo } from "./volume_info";

export class SlabControl {
  private readonly thickness = byId("slab-thickness", HTMLInputElement);
  private readonly reduce = byId("slab-reduce", HTMLSelectElement);
  private readonly grey = byId("slice-grey", HTMLInputElement);
  private readonly fault = byId("slab-fault", HTMLElement);

  constructor(private readonly onChange: (change: Partial<SliceState>) => void) {
    this.thickness.addEventListener("change", () => this.changeThickness());
    this.reduce.addEventListener("change", () => {
      const reduce = kReduces.find((value) => value === this.reduce.value);
      if (reduce) this.onChange({ reduce });
    });
    this.grey.addEventListener("change", () => this.onChange({ isGrey: this.grey.checked }));
  }

  // Between labels there is no mean, and voxels of their own colours have no greys.
  setVolume({ channels, type }: VolumeInfo): void {
    const areLabels = channels.some((channel) => channel.areLabels);
    for (const option of this.reduce.options) option.disabled = option.value === "mean" && areLabels;
    this.grey.disabled = areLabels || type === "rgba8";
  }

  show({ thickness, reduce, isGrey }: SliceState): void {
    if (document.activeElement !== this.thickness) this.thickness.value = String(thickness);
    this.reduce.value = reduce;
    this.reduce.disabled = thickness === 1;
    this.grey.checked = isGrey && !this.grey.disabled;
  }

  private changeThickness(): void {
    const thickness = Number(this.thickness.value);
    const isFine = Number.isInteger(thickness) && thickness >= 1 && thickness <= kMostThickness;
    this.fault.hidden = isFine;
    this.thickness.setAttribute("aria-invalid", String(!isFine));
    this.fault.textContent = isFine ? "" : `A slab has 1 to ${kMostThickness} voxels.`;
    if (isFine) this.onChange({ thickness });
  }
}
