// Small things about the document.

export const $ = (id) => document.getElementById(id);

/** @param properties  of the element; `data`, `aria` and `class` besides */
export function element(tag, {data = {}, aria = {}, ...properties} = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  Object.assign(made.dataset, data);
  for (const [key, value] of Object.entries(aria)) made.setAttribute(`aria-${key}`, value);
  made.append(...children);
  return made;
}

/** Keeps a number field and a value of the store together.
 *  @param scale  of what is shown: 0.001 shows metres as kilometres
 *  @param empty  what an empty field means; undefined: empty is wrong */
export function bind_number(input, store, key, {scale = 1, empty} = {}) {
  const read = () => (input.value === '' ? empty : Number((Number(input.value) / scale).toPrecision(12)));
  const show = (value) => {
    // What means the same stays as it is being typed.
    if (document.activeElement !== input || read() !== value) input.value = value === null ? '' : String(Number((value * scale).toPrecision(12)));
  };
  show(store.state[key]);
  store.on([key], (state) => show(state[key]));
  input.addEventListener('input', () => {
    const left_out = input.value === '' && !input.validity.badInput && empty !== undefined;
    const good = left_out || (input.value !== '' && input.validity.valid);
    input.setAttribute('aria-invalid', String(!good));
    if (good) store.set({[key]: read()});
  });
  input.addEventListener('blur', () => {
    input.setAttribute('aria-invalid', 'false');
    show(store.state[key]);
  });
}

/** Two number fields that count only together, as a pair or null. */
export function bind_pair(inputs, store, key) {
  const show = (pair) => inputs.forEach((input, i) => {
    if (!inputs.includes(document.activeElement)) input.value = pair ? String(pair[i]) : '';
  });
  show(store.state[key]);
  store.on([key], (state) => show(state[key]));
  for (const input of inputs) {
    input.addEventListener('input', () => {
      const given = inputs.filter(({value}) => value !== '').length;
      const good = inputs.every(({validity}) => validity.valid) && given !== 1;
      for (const field of inputs) field.setAttribute('aria-invalid', String(!field.validity.valid || (given === 1 && field.value === '')));
      if (good) store.set({[key]: given ? inputs.map(({value}) => Number(value)) : null});
    });
  }
}

/** A text field for something that `read` understands; what it does not, is marked and left alone. */
export function text_field(properties, read, take) {
  const input = element('input', {type: 'text', spellcheck: false, autocomplete: 'off', ...properties});
  input.addEventListener('change', () => {
    const value = read(input.value);
    input.setAttribute('aria-invalid', String(value === null));
    if (value !== null) take(value);
  });
  return input;
}

/** Writes a value where nobody is typing. */
export function fill(input, value) {
  if (document.activeElement === input || input.value === value) return;
  input.value = value;
  input.setAttribute('aria-invalid', 'false');
}

export function save(blob, name) {
  const url = URL.createObjectURL(blob);
  element('a', {href: url, download: name}).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
