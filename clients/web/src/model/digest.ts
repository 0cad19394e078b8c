/**
 * Hash of one surfel's id and version (protocol/SPEC.md). The digest of a model is the sum of the hashes of its
 * surfels and nodes modulo 2^32, so it follows every change in constant time, in any order.
 */
export function surfelDigest(id: number, version: number): number {
  return mixed((Math.imul(id, 0x9e3779b1) + Math.imul(version, 0x85ebca77)) | 0);
}

/** Hash of one node's id and place. */
export function nodeDigest(id: number, x: number, y: number, z: number): number {
  const sum = Math.imul(id, 0x27d4eb2f) + Math.imul(x, 0x165667b1) + Math.imul(y, 0x9e3779b1);
  return mixed((sum + Math.imul(z, 0x85ebca77) + 1) | 0);
}

/** MurmurHash3's 32-bit finalizer. */
function mixed(sum: number): number {
  let h = sum;
  h ^= h >>> 16;
  h = Math.imul(h, 0x85ebca6b);
  h ^= h >>> 13;
  h = Math.imul(h, 0xc2b2ae35);
  return (h ^ (h >>> 16)) >>> 0;
}
