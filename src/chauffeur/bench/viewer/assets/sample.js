/* One sample: the conversation, what the checks and the judge said in words, and the drive beside it. */
const ROLES = { system: 'System message', user: 'Prompt', assistant: 'Reply' };

function listing(title, lines) {
  const list = make('ol');
  lines.forEach((tokens, place) => {
    const code = make('code');
    for (const [kind, text] of tokens) code.append(make('span', text, kind));
    const item = box('li', null, code);
    item.dataset.n = place + 1;
    list.append(item);
  });
  const frame = box('div', 'code', list);
  frame.tabIndex = 0;
  frame.setAttribute('role', 'region');
  frame.setAttribute('aria-label', title);
  return box('section', 'part', make('h3', title), frame);
}

function words(title, text, className) {
  if (!text) return null;
  const body = make('p', text, `prose ${className || ''}`);
  body.dir = 'auto';
  return box('section', 'part', make('h3', title), body);
}

/* Turns in order; a prompt after a reply asks for a repair. What every sample is told first is folded. */
function conversation(turns, others) {
  let replies = 0;
  return turns.map((turn) => {
    const again = turn.role === 'user' && replies > 0;
    if (turn.role === 'assistant') replies += 1;
    const title = again ? 'Repair asked for' : turn.role === 'assistant' && replies > 1 ? 'Reply, repaired' : ROLES[turn.role] || turn.role;
    const body = make('pre', null, 'turn-text');
    body.dir = 'auto';
    body.append(...marked(turn.text, others && turn.role === 'assistant' ? others : null));
    const node = turn.role === 'system' ? folded(`${title} (${turn.text.length.toLocaleString('en')} characters)`, body) : box('div', null, make('h3', title), body);
    return box('section', `turn ${turn.role}${again ? ' repair' : ''}`, node);
  });
}

/* Lines that none of the other texts has are marked. */
function marked(text, others) {
  if (!others) return [text];
  return text.split('\n').flatMap((one, place) => {
    const known = !one.trim() || others.has(one.trim());
    return [place ? '\n' : '', known ? one : make('mark', one)];
  });
}

const linesOf = (sample) => new Set([sample.reply, ...sample.turns.filter((turn) => turn.role === 'assistant').map((turn) => turn.text)].join('\n').split('\n').map((one) => one.trim()));

function verdictList(sample) {
  if (!sample.verdicts.length) return null;
  const list = make('ul', null, 'verdicts');
  for (const verdict of sample.verdicts) {
    const sign = make('b', verdict.passed ? '✓' : '✗');
    sign.setAttribute('role', 'img');
    sign.setAttribute('aria-label', verdict.passed ? 'passed' : 'not passed');
    const item = box('li', verdict.passed ? 'pass' : 'fail', sign, make('span', verdict.reason || (verdict.passed ? 'Passed.' : 'Not passed.')));
    if (verdict.remedy && !verdict.passed) item.append(make('span', verdict.remedy));
    item.append(make('small', verdict.line ? `${verdict.check}, line ${verdict.line}` : verdict.check));
    list.append(item);
  }
  return box('section', 'part', make('h3', 'Checks'), list);
}

function pairs(entries) {
  const list = make('dl', null, 'facts');
  for (const [name, value] of entries) {
    if (value === '') continue;
    const said = make('dd', value);
    said.dir = 'auto';
    list.append(make('dt', name), said);
  }
  return list;
}

function transcript(sample, others) {
  const told = sample.turns.length > 0;
  const parts = [];
  if (!sample.drivable && sample.note) sample.why.push(sample.note);
  const facts = [...(sample.goal ? [['wanted', sample.goal]] : []), ...sample.facts, ...sample.cost];
  parts.push(box('section', 'part', ...sample.why.map((sentence) => make('p', sentence, 'why')), facts.length ? pairs(facts) : null));
  if (told) parts.push(...conversation(sample.turns, others));
  else {
    parts.push(words('What it was told of the scene', sample.context));
    if (sample.words !== sample.item) parts.push(words('Asked', sample.words));
    parts.push(words('Its reasoning', sample.thoughts, 'reasoning'));
  }
  if (sample.refusal) parts.push(words('It declined', sample.refusal));
  if (sample.error) parts.push(words('No answer', sample.error));
  if (sample.program.length) parts.push(listing('Program', sample.program));
  if (sample.library.length) parts.push(listing('Functions of its policy repository', sample.library));
  parts.push(verdictList(sample));
  if (!told && sample.reply) {
    const body = make('pre', null, 'turn-text');
    body.append(...marked(sample.reply, others));
    parts.push(folded('The reply as it came', body));
  }
  parts.push(folded('All columns of the row', pairs(sample.row)));
  return box('div', 'transcript', ...parts);
}

/* The page of a drive in a frame of its own, which reaches nothing of this page. */
function framed(page, title) {
  const frame = document.createElement('iframe');
  frame.title = title;
  frame.setAttribute('sandbox', 'allow-scripts');
  frame.srcdoc = page;
  return frame;
}

async function fillDrive(node, id, place, sample) {
  if (!sample.drivable) return;
  const waiting = make('p', 'The drive is being driven again …', 'no-drive');
  node.append(waiting);
  const drive = await ask(`drive ${id} ${place}`);
  if (!node.isConnected) return;
  waiting.remove();
  if (drive.note) node.append(make('p', drive.note, 'note'));
  if (drive.page) node.append(framed(drive.page, 'The drive'));
}
