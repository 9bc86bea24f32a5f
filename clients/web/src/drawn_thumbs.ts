// SPDX-License-Identifier: Apache-2.0
// Small pictures that the server draws for a panel: few at a time, and none any more once the panel is closed.

const kAtOnce = 2;

export interface WantedThumb {
  readonly canvas: HTMLCanvasElement;
  readonly address: string;
}

export class DrawnThumbs {
  private waiting: WantedThumb[] = [];
  private abort = new AbortController();
  private drawing = 0;

  // Instead of what was wanted before.
  want(thumbs: readonly WantedThumb[]): void {
    this.close();
    this.waiting = [...thumbs];
    this.next(this.abort);
  }

  close(): void {
    this.abort.abort();
    this.abort = new AbortController();
    this.waiting = [];
    this.drawing = 0;
  }

  private next(own: AbortController): void {
    while (own === this.abort && this.drawing < kAtOnce) {
      const thumb = this.waiting.shift();
      if (thumb === undefined) return;
      this.drawing++;
      void draw(thumb, own.signal).then(() => {
        if (own !== this.abort) return;
        this.drawing--;
        this.next(own);
      });
    }
  }
}

// Where nothing comes it stays empty.
async function draw({ canvas, address }: WantedThumb, signal: AbortSignal): Promise<void> {
  try {
    const response = await fetch(address, { signal });
    if (!response.ok) return;
    const picture = await createImageBitmap(await response.blob());
    canvas.getContext("2d")?.drawImage(picture, 0, 0, canvas.width, canvas.height);
    picture.close();
    canvas.dataset["drawn"] = "true";
  } catch (error) {
    if (error instanceof DOMException || error instanceof TypeError) return; // closed, away, or no picture
    throw error;
  }
}
