/* From a microphone's rate to 16 kHz: a windowed sinc, piece by piece, in whole-number phases. */

export const RATE_HZ = 16000;
const LOBES = 16;
const PASS = 0.92; // of the lower of the two Nyquist frequencies

const divisor = (a, b) => (b === 0 ? a : divisor(b, a % b));

export class Resampler {
  constructor(fromHz) {
    const common = divisor(Math.round(fromHz), RATE_HZ);
    this.down = Math.round(fromHz) / common;
    this.up = RATE_HZ / common;
    const cut = PASS * Math.min(1, this.up / this.down);
    this.half = Math.ceil(LOBES / Math.min(1, this.up / this.down));
    this.taps = Array.from({ length: this.up }, (_, phase) => this.filter(phase / this.up, cut));
    this.kept = new Float32Array(this.half * 2);
    this.skip = 0; // input samples from the start of `kept` to the next output
    this.phase = 0;
  }

  /* Weights of the inputs around a point that lies `share` of a sample behind the middle one; they add up to 1. */
  filter(share, cut) {
    const taps = new Float64Array(this.half * 2 + 1);
    let sum = 0;
    for (let i = 0; i < taps.length; i += 1) {
      const t = i - this.half - share;
      const x = Math.PI * t * cut;
      const window = Math.abs(t) >= this.half + 1 ? 0 : 0.5 + 0.5 * Math.cos((Math.PI * t) / (this.half + 1));
      taps[i] = (Math.abs(x) < 1e-9 ? 1 : Math.sin(x) / x) * window;
      sum += taps[i];
    }
    return taps.map((tap) => tap / sum);
  }

  /* Samples at 16 kHz, as many as can be told by now. */
  push(input) {
    const all = new Float32Array(this.kept.length + input.length);
    all.set(this.kept);
    all.set(input, this.kept.length);
    const out = [];
    let at = this.skip;
    while (at + this.half * 2 < all.length) {
      const taps = this.taps[this.phase];
      let sum = 0;
      for (let i = 0; i < taps.length; i += 1) sum += taps[i] * all[at + i];
      out.push(sum);
      this.phase += this.down;
      at += Math.floor(this.phase / this.up);
      this.phase %= this.up;
    }
    const from = Math.min(at, all.length);
    this.kept = all.slice(from);
    this.skip = at - from;
    return Float32Array.from(out);
  }
}

/* As 16 bit, little-endian. */
export function toPcm(samples) {
  const view = new DataView(new ArrayBuffer(samples.length * 2));
  samples.forEach((sample, i) => view.setInt16(i * 2, Math.round(Math.max(-1, Math.min(1, sample)) * 32767), true));
  return view.buffer;
}
