// Light and dark. Colours live in style.css; what is drawn on canvases asks for them here.

export const dark = () => {
  const asked = document.documentElement.dataset.theme;
  return asked === 'dark' || (asked !== 'light' && matchMedia('(prefers-color-scheme: dark)').matches);
};

let probe = null;

/** A colour of style.css by its name, as rgb. */
export function ink(name) {
  if (!probe) {
    probe = document.createElement('i');
    probe.hidden = true;
    document.body.append(probe);
  }
  probe.style.color = `var(${name})`;
  return getComputedStyle(probe).color;
}

export function use_theme(theme) {
  document.documentElement.dataset.theme = theme;
}

export const on_system_change = (call) => matchMedia('(prefers-color-scheme: dark)').addEventListener('change', call);
