/* In the audio thread: sound while it is switched on, in pieces of 0.04 s; nothing is kept while it is off. */

import { RATE_HZ, Resampler, toPcm } from './resample.js';

const PIECE = RATE_HZ / 25;

class Recorder extends AudioWorkletProcessor {
  constructor() {
    super();
    this.clear(false);
    this.port.onmessage = (event) => {
      if (!event.data && this.on) this.send(this.count);
      if (!event.data) this.port.postMessage({ done: true });
      this.clear(event.data);
    };
  }

  clear(on) {
    this.on = on;
    this.resampler = new Resampler(sampleRate);
    this.waiting = new Float32Array(PIECE * 2);
    this.count = 0;
  }

  send(length) {
    if (!length) return;
    const piece = this.waiting.slice(0, length);
    let power = 0;
    for (const sample of piece) power += sample * sample;
    const sound = toPcm(piece);
    this.port.postMessage({ sound, level: Math.sqrt(power / length) }, [sound]);
    this.waiting.copyWithin(0, length, this.count);
    this.count -= length;
  }

  process(inputs) {
    const channels = inputs[0];
    if (!this.on || !channels.length) return true;
    const mono = new Float32Array(channels[0].length);
    for (const channel of channels) channel.forEach((sample, i) => { mono[i] += sample / channels.length; });
    const samples = this.resampler.push(mono);
    if (this.count + samples.length > this.waiting.length) this.send(PIECE);
    this.waiting.set(samples, this.count);
    this.count += samples.length;
    while (this.count >= PIECE) this.send(PIECE);
    return true;
  }
}

registerProcessor('recorder', Recorder);
