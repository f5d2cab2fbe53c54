// Whole numbers, of 24 bits with the sign last: byte by byte apart, deflated, in base64.
async function unpackIntegers(text) {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const plain = new Uint8Array(await new Response(stream).arrayBuffer()), count = plain.length / 3;
  const numbers = new Int32Array(count);
  for (let i = 0; i < count; i++) {
    const unsigned = plain[i] | (plain[count + i] << 8) | (plain[2 * count + i] << 16);
    numbers[i] = (unsigned >> 1) ^ -(unsigned & 1);
  }
  return numbers;
}
