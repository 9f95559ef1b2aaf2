/* Elements. Text is set with textContent only: what people and models wrote is never markup. */
const $ = (id) => document.getElementById(id);

function make(tag, text, className) {
  const node = document.createElement(tag);
  if (text !== undefined && text !== null) node.textContent = text;
  if (className) node.className = className;
  return node;
}

function box(tag, className, ...children) {
  const node = make(tag, null, className);
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

function drawn(tag, attributes) {
  const node = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  return node;
}

function link(text, href, className) {
  const node = make('a', text, className);
  node.href = href;
  return node;
}

function button(text, className, act) {
  const node = make('button', text, className);
  node.type = 'button';
  node.addEventListener('click', act);
  return node;
}

/* A field with its label around it; `choices` are [value, text]. */
function choice(label, choices, chosen, act) {
  const select = document.createElement('select');
  for (const [value, text] of choices) {
    const option = make('option', text);
    option.value = value;
    select.append(option);
  }
  select.value = chosen;
  select.addEventListener('change', () => act(select.value));
  return box('label', 'field', make('span', label), select);
}

function folded(title, ...children) {
  return box('details', null, make('summary', title), ...children);
}

const labels = (texts) => texts.map((text) => make('span', text, 'label'));
const plural = (count, one, more) => `${count.toLocaleString('en')} ${count === 1 ? one : more || `${one}s`}`;
const named = (text) => text.replaceAll('_', ' ');

function when(seconds) {
  const date = new Date(seconds * 1000);
  const today = new Date().toDateString() === date.toDateString();
  const clock = date.toLocaleTimeString('en-GB', { hour: '2-digit', minute: '2-digit' });
  return today ? `today ${clock}` : `${date.toLocaleDateString('en-CA')} ${clock}`;
}
