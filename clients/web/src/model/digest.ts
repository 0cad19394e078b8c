/**
 * Hash of one surfel's id and version (protocol/SPEC.md). The digest of a model is the sum of the hashes
 * modulo 2^32, so it follows every change in constant time, in any order.
 */
export function surfelDigest(id: number, version: number): number {
  let h = (Math.imul(id, 0x9e3779b1) + Math.imul(version, 0x85ebca77)) | 0;
  h ^= h >>> 16;
  h = Math.imul(h, 0x85ebca6b);
  h ^= h >>> 13;
  h = Math.imul(h, 0xc2b2ae35);
  return (h ^ (h >>> 16)) >>> 0;
}
