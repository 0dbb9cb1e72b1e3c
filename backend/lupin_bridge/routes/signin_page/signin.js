// Trades the token for a session cookie. The token travels in a header and is kept nowhere.

const form = document.querySelector('form');
const input = document.querySelector('input');
const button = document.querySelector('button');
const message = document.querySelector('#message');

// What it may have to say, in the page's language.
const words = form.dataset;

// The page's language goes along.
const enter = () => location.replace(`./${location.search}`);

/** What went wrong, for a person; the bridge words its refusals itself. */
const reasonOf = async (response) => {
  const body = await response.json().catch(() => ({}));
  return body.detail ?? words.refused.replace('%', response.status);
};

const signIn = async () => {
  const token = input.value.trim();
  if (!/^[\w.~+/-]+=*$/.test(token)) {
    return words.odd;
  }
  const headers = { Authorization: `Bearer ${token}`, 'X-Lupin-Twin': '1' };
  const response = await fetch('api/signin', { method: 'POST', headers });
  if (response.ok) {
    enter();
    return '';
  }
  return response.status === 401 ? words.wrong : reasonOf(response);
};

form.addEventListener('submit', (event) => {
  event.preventDefault();
  button.disabled = true;
  message.textContent = '';
  signIn()
    .catch(() => words.silent)
    .then((text) => {
      message.textContent = text;
      button.disabled = false;
      if (text) input.select();
    });
});

// A link on another page led here although a session is open: a strict cookie stays home then.
fetch('readyz', { method: 'HEAD', cache: 'no-store' })
  .then((response) => {
    if (response.status === 200 || response.status === 503) enter();
  })
  .catch(() => {}); // told when the person tries
