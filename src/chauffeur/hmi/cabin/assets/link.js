/* The connection to the session: comes back by itself, and says when it is gone. */

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 5000;

/* hear(message): one of the session. changed(state): 'open', 'lost', 'ended'. */
export function openLink({ hear, changed }) {
  let socket = null;
  let wait = FIRST_WAIT_MS;
  let ended = false;

  function connect() {
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    socket = new WebSocket(`${scheme}://${location.host}${location.pathname}talk`);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      wait = FIRST_WAIT_MS;
      changed('open');
    };
    socket.onmessage = (event) => {
      const message = JSON.parse(event.data);
      ended = ended || message.kind === 'ended';
      hear(message);
    };
    socket.onclose = () => {
      changed(ended ? 'ended' : 'lost');
      if (ended) return;
      setTimeout(connect, wait);
      wait = Math.min(wait * 1.6, LONGEST_WAIT_MS);
    };
  }

  const isOpen = () => socket !== null && socket.readyState === WebSocket.OPEN;

  /* Whether it was handed to the connection. */
  function say(kind, fields = {}) {
    if (!isOpen()) return false;
    socket.send(JSON.stringify({ kind, ...fields }));
    return true;
  }

  /* Sound that cannot leave at once is of no use later. */
  function sound(samples) {
    if (isOpen() && socket.bufferedAmount < 64000) socket.send(samples);
  }

  connect();
  return { say, sound, isOpen };
}
