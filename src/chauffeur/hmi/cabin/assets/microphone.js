/* The browser's microphone: asked for when it is first needed, given back when it was not used for a while. */

const GIVE_BACK_MS = 20000;

const REFUSALS = {
  NotAllowedError: 'The browser does not let this page use the microphone. Allow it beside the address, or type your wish.',
  NotFoundError: 'No microphone was found. Plug one in, or type your wish.',
  NotReadableError: 'Another program has the microphone. Close it, or type your wish.',
};

/* sound(buffer): 16 kHz, 16 bit, mono. level(share): 0 to 1, how loud it is. lost(why): the microphone is gone. */
export function makeMicrophone({ sound, level, lost }) {
  let context = null;
  let node = null;
  let stream = null;
  let opening = null;
  let flushed = null;
  let giveBack = 0;

  function why(error) {
    if (!navigator.mediaDevices) return 'The browser gives a microphone only to pages on this machine or over https. Type your wish instead.';
    return REFUSALS[error.name] || `The microphone cannot be used (${error.message || error.name}). Type your wish.`;
  }

  async function begin() {
    stream = await navigator.mediaDevices.getUserMedia({
      audio: { channelCount: 1, echoCancellation: true, noiseSuppression: true, autoGainControl: true },
    });
    context = new AudioContext();
    await context.audioWorklet.addModule('recorder.js');
    node = new AudioWorkletNode(context, 'recorder', { numberOfOutputs: 0 });
    node.port.onmessage = ({ data }) => {
      if (data.done) {
        if (flushed) flushed();
        flushed = null;
      } else {
        sound(data.sound);
        level(Math.min(1, data.level * 6));
      }
    };
    context.createMediaStreamSource(stream).connect(node);
    stream.getAudioTracks()[0].addEventListener('ended', () => {
      close();
      lost('The microphone was unplugged, or the browser took it back.');
    });
    await context.resume();
  }

  /* Throws words where there is no microphone. */
  async function open() {
    clearTimeout(giveBack);
    if (!opening) {
      opening = begin().catch((error) => {
        const words = why(error);
        close();
        throw new Error(words);
      });
    }
    await opening;
  }

  function on() {
    clearTimeout(giveBack);
    node.port.postMessage(true);
  }

  /* Resolves when the last sound was handed on. */
  function off() {
    if (!node) return Promise.resolve();
    clearTimeout(giveBack);
    giveBack = setTimeout(close, GIVE_BACK_MS);
    level(0);
    return new Promise((resolve) => {
      flushed = resolve;
      node.port.postMessage(false);
      setTimeout(resolve, 500); // an audio thread that hangs holds up nobody
    });
  }

  function close() {
    clearTimeout(giveBack);
    if (stream) for (const track of stream.getTracks()) track.stop();
    if (context) context.close();
    context = null;
    node = null;
    stream = null;
    opening = null;
    level(0);
  }

  return { open, on, off, close };
}
