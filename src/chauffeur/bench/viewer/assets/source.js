/* Where answers come from: this file, where it holds them, or the server that gave the page. */
const block = $('answers');
const held = block ? JSON.parse(block.textContent) : null;
const packs = new Map([...document.querySelectorAll('script[data-pack]')].map((node) => [node.dataset.pack, node]));
const unpacked = new Map();
const line = { socket: null, number: 0, waiting: new Map(), changed: () => {} };

async function unpack(key) {
  if (!unpacked.has(key)) {
    const bytes = Uint8Array.from(atob(packs.get(key).textContent), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
    unpacked.set(key, new Response(stream).json());
  }
  return unpacked.get(key);
}

async function heldAnswer(key) {
  if (key in held) return held[key];
  if (packs.has(key)) return unpack(key);
  const [what, id, place] = key.split(' ');
  if (what === 'sample') return (await unpack(`samples ${id}`))[Number(place)];
  if (what === 'drive') return { page: '', note: 'This file does not hold the drive; open the run with chauffeur view.' };
  throw new Error('This file does not hold that; open the runs with chauffeur view.');
}

function ask(key) {
  if (held) return heldAnswer(key);
  return new Promise((resolve, reject) => {
    const number = (line.number += 1);
    const send = () => line.socket.send(JSON.stringify({ n: number, key }));
    line.waiting.set(number, { resolve, reject });
    if (line.socket.readyState === WebSocket.OPEN) send();
    else if (line.socket.readyState === WebSocket.CONNECTING) line.socket.addEventListener('open', send, { once: true });
    else reject(new Error('The viewer has ended. Start it again and open its new address.'));
  });
}

function hear(event) {
  const told = JSON.parse(event.data);
  if (told.index) {
    line.changed(told.index);
    return;
  }
  const one = line.waiting.get(told.n);
  if (!one) return;
  line.waiting.delete(told.n);
  if (told.trouble) one.reject(new Error(told.trouble));
  else one.resolve(told.answer);
}

if (!held) {
  const address = new URL('talk', document.baseURI.split('#')[0]);
  address.protocol = address.protocol.replace('http', 'ws');
  line.socket = new WebSocket(address);
  line.socket.addEventListener('message', hear);
  line.socket.addEventListener('open', () => $('live').append(make('span', 'live', 'pulse')));
  line.socket.addEventListener('close', () => {
    $('live').textContent = 'ended';
    for (const one of line.waiting.values()) one.reject(new Error('The viewer has ended. What is shown stays.'));
    line.waiting.clear();
  });
}
