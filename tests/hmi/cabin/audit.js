// What on the page is too faint (WCAG 2.2 AA), or not on the screen. Evaluates to a list of complaints.
(() => {
  const complaints = [];
  const parse = (text) => {
    const found = text.match(/[\d.]+/g).map(Number);
    if (text.startsWith('color(srgb')) return [found[0] * 255, found[1] * 255, found[2] * 255, found[3] ?? 1];
    return [found[0], found[1], found[2], found[3] ?? 1];
  };
  const over = (front, back) => [0, 1, 2].map((i) => front[i] * front[3] + back[i] * (1 - front[3])).concat(1);
  const backOf = (element) => {
    const layers = [];
    for (let at = element; at; at = at.parentElement) {
      const colour = parse(getComputedStyle(at).backgroundColor);
      layers.push(colour);
      if (colour[3] === 1) break;
    }
    return layers.reverse().reduce((back, front) => over(front, back), [255, 255, 255, 1]);
  };
  const luminance = (colour) => {
    const [r, g, b] = colour.slice(0, 3).map((v) => v / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const ratio = (a, b) => {
    const [light, dark] = [luminance(a), luminance(b)].sort((x, y) => y - x);
    return (light + 0.05) / (dark + 0.05);
  };
  const shown = (element) => {
    if (!element.checkVisibility()) return false;
    const box = element.getBoundingClientRect();
    return box.width > 2 && box.height > 2;
  };
  const nameOf = (element) => `${element.tagName}#${element.id}.${element.className} “${element.textContent.trim().slice(0, 30)}”`;

  let texts = 0;
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const element = walker.currentNode.parentElement;
    if (!walker.currentNode.textContent.trim() || !shown(element)) continue;
    texts += 1;
    const style = getComputedStyle(element);
    const pixels = parseFloat(style.fontSize);
    const large = pixels >= 24 || (pixels >= 18.66 && Number(style.fontWeight) >= 700);
    const back = backOf(element);
    const found = ratio(over(parse(style.color), back), back);
    if (found < (large ? 3 : 4.5)) complaints.push(`${found.toFixed(2)} of ${nameOf(element)}`);
  }
  if (texts < 20) complaints.push(`only ${texts} texts`);

  for (const element of document.querySelectorAll('.dock button, .dock input, .panel button, select')) {
    if (!shown(element) || element.disabled || element.matches('.close')) continue;
    const style = getComputedStyle(element);
    const around = backOf(element.parentElement);
    const edge = Math.max(ratio(over(parse(style.borderTopColor), around), around), ratio(over(parse(style.backgroundColor), around), around));
    if (edge < 3) complaints.push(`edge ${edge.toFixed(2)} of ${nameOf(element)}`);
    if (element.matches('button') && element.getBoundingClientRect().height < 44) complaints.push(`only ${element.getBoundingClientRect().height} px high: ${nameOf(element)}`);
  }
  const placeholder = getComputedStyle(document.getElementById('wish'), '::placeholder');
  const field = backOf(document.getElementById('wish'));
  if (ratio(parse(placeholder.color), field) < 4.5) complaints.push('the placeholder is faint');

  for (const element of document.querySelectorAll('button, input, select, canvas, [role=tab]')) {
    if (!shown(element) || element.closest('.panel')) continue;
    const box = element.getBoundingClientRect();
    if (box.left < -1 || box.right > innerWidth + 1 || box.top < -1 || box.bottom > innerHeight + 1) complaints.push(`off the screen: ${nameOf(element)}`);
    const named = element.getAttribute('aria-label') || element.textContent.trim() || (element.labels && element.labels.length);
    if (!named) complaints.push(`no name: ${nameOf(element)}`);
  }
  if (document.documentElement.scrollWidth > innerWidth) complaints.push('wider than the screen');
  return complaints;
})()
