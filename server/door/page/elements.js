// Elements of the page. Whatever comes from a wall goes in as text: nothing is ever read as HTML.

/**
 * @param {string} tag
 * @param {Record<string, any>} [properties] `class`, `text`, `onclick` and other handlers; all else are attributes, of
 *     which null and false are left out
 * @param {...(Node | string)} children
 */
export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === null || value === undefined || value === false) continue;
    if (name === 'class') made.className = value;
    else if (name === 'text') made.textContent = value;
    else if (name.startsWith('on')) made.addEventListener(name.slice(2), value);
    else made.setAttribute(name, value === true ? '' : String(value));
  }
  made.append(...children);
  return made;
}

/** The same of a drawing; all properties are attributes. */
export function drawn(tag, attributes = {}, text = '') {
  const made = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.textContent = text;
  return made;
}

/** Leaves alone what is right already: who reads the page aloud would say it again. */
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

const kVisible = /[^\p{White_Space}\p{Default_Ignorable_Code_Point}\p{Cc}\p{Cf}\u2800]/u;
const kMostCodes = 8;
const kTurns = /[\u202A-\u202E\u2066-\u2069]/g;  // marks that turn what follows, from left to right or back

/** What the wall says in words of its own, with names among them that turn none of the others. */
export function straight(text) {
  return text.replace(kTurns, '');
}
/** Turns itself, and nothing beside it: whatever it begins ends with it. */
function closed(name) {
  if (name.search(kTurns) < 0) return name;
  const kept = name.replace(/[\u2066-\u2069]/g, '');
  let open = 0;
  for (const [mark] of kept.matchAll(kTurns)) open = mark === '\u202C' ? Math.max(0, open - 1) : open + 1;
  return kept + '\u202C'.repeat(open);
}

/** A name, or a path, as people see it: what nobody would see of it in code points. */
export function seen(text) {
  return text.split('/').map((name) => {
    if (name === '' || kVisible.test(name)) return closed(name);
    const codes = [...name.slice(0, 2 * kMostCodes + 1)].map((letter) => letter.codePointAt(0));
    const told = codes.slice(0, kMostCodes).map((code) => `U+${code.toString(16).toUpperCase().padStart(4, '0')}`);
    return told.join(' ') + (codes.length > kMostCodes ? ' …' : '');
  }).join('/');
}

/** The children of `parent` are `wanted`, in this order. What stays, whatever goes before it, keeps the focus. */
export function setChildren(parent, wanted) {
  const stays = new Set(wanted);
  for (const child of [...parent.childNodes]) if (!stays.has(child)) child.remove();
  let at = parent.firstChild;
  for (const child of wanted) {
    if (child === at) at = at.nextSibling;
    else parent.insertBefore(child, at);
  }
}

export function pause(ms) {
  return new Promise((resolve) => { setTimeout(resolve, ms); });
}

let lastId = 0;
/** For what one element says of another: labels, descriptions. */
export function freshId(prefix) {
  return `${prefix}-${++lastId}`;
}
