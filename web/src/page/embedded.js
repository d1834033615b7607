// Lamps that lie in the page itself: base64 of gzip, in elements that hold data and are no scripts.

/** Elements of lamps: the one that the page was made for, and examples. */
export function embedded() {
  const all = [...document.querySelectorAll('script[type="application/vnd.purelight"]')];
  return {
    own: all.find((block) => !block.hasAttribute("data-example")),
    examples: all.filter((block) => block.hasAttribute("data-example")),
  };
}

/** The bytes of an embedded lamp. */
export async function bytesOf(block) {
  const text = atob(block.textContent.trim());
  const packed = Uint8Array.from(text, (character) => character.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}
