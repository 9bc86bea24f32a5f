// SPDX-License-Identifier: Apache-2.0
// Files of the person's own machine: saved from the page, and read into it. Nothing is sent anywhere.

export const saveText = (name: string, text: string): void => saveBlob(name, new Blob([text], { type: "application/json" }));

// Saves bytes under this name, where the browser saves things.
export function saveBlob(name: string, bytes: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(bytes);
  link.download = name;
  link.click();
  // The browser has taken it by then; at once is too early for some.
  window.setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

export const safeName = (name: string): string => name.replace(/[^\w.-]+/g, "_").slice(0, 80) || "unnamed";

// A button that asks for a file. `read` gets its bytes and name, at most so many bytes; `fail` what is wrong with it.
export function bindFileButton(button: HTMLButtonElement, input: HTMLInputElement, mostBytes: number, read: (bytes: Uint8Array, name: string) => void, fail: (name: string, reason: string) => void): void {
  button.addEventListener("click", () => input.click());
  input.addEventListener("change", () => {
    const file = input.files?.[0];
    if (file !== undefined) void take(file);
    input.value = ""; // the same file again is another change
  });
  const take = async (file: File): Promise<void> => {
    try {
      if (file.size > mostBytes) throw new Error(`it has ${file.size} bytes, at most ${mostBytes} are read`);
      read(new Uint8Array(await file.arrayBuffer()), file.name);
    } catch (error) {
      fail(file.name, error instanceof Error ? error.message : String(error));
    }
  };
}
