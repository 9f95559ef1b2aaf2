/* Small helpers for the page's elements. Words of people and models are only ever set as text. */

export const $ = (id) => document.getElementById(id);

/* An element with properties; `class`, `data-…`, `aria-…` and other attributes by their own names. */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name === 'onclick') element.addEventListener('click', value);
    else if (name === 'text') element.textContent = value;
    else element.setAttribute(name, value === true ? '' : value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined && child !== ''));
  return element;
}

/* Set text only where it is another: a live region speaks at every change. */
export function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

let turn = false;
/* Tell a screen reader. The same words twice are two messages. */
export function tell(text) {
  turn = !turn;
  $('told').textContent = turn ? text : `${text}\u00a0`;
}
