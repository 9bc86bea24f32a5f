// SPDX-License-Identifier: Apache-2.0
// A file that is dropped on the page: files are the server's, so it is said how one gets there. Without this the browser
// would leave the page for the file.

import { byId } from "./dom";
import type { Toasts } from "./toasts";

const kForPanel = /\.(json|vp|lut)$/i;

export class FileDrop {
  constructor(toasts: Toasts) {
    window.addEventListener("dragover", (event) => {
      if (event.dataTransfer?.types.includes("Files")) event.preventDefault();
    });
    window.addEventListener("drop", (event) => {
      const name = event.dataTransfer?.files[0]?.name;
      if (name === undefined) return;
      event.preventDefault();
      toasts.show({ title: `${name} is not opened from here`, detail: hintFor(name), field: null });
    });
    byId("own-file", HTMLElement).textContent = hintFor("FILE");
  }
}

// What to type for it, where the server runs.
export function hintFor(name: string): string {
  if (kForPanel.test(name)) return "Load marks, bookmarks and transfer functions with the buttons in the panel.";
  const base = name.replace(/(\.(ome|nii|tar))?\.[^.]*$/i, "") || name;
  const source = quoted(name);
  const target = quoted(`${base}.bwv`);
  if (/\.bwv$/i.test(name)) return `Where the server runs: blockwalkd ${source}`;
  return `Where the server runs: blockwalk import ${source} -o ${target}, then blockwalkd ${target}`;
}

// For a shell.
function quoted(name: string): string {
  const path = name.startsWith("-") ? `./${name}` : name; // or it would be an option
  return /^[\w./-]+$/.test(path) ? path : `'${path.replaceAll("'", "'\\''")}'`;
}
