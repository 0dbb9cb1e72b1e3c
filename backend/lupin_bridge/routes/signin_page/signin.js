// Trades a token, or a name and its password, for a session cookie. Neither is kept anywhere.

const form = document.querySelector('form');
const person = document.querySelector('#name');
const input = document.querySelector('#token');
const button = document.querySelector('button');
const message = document.querySelector('#message');

// What it may have to say, in the page's language.
const words = form.dataset;

// The page leads here when its session is over, with the view that it showed.
const [reason, ...view] = location.hash.slice(1).split('&');

// The page's language goes along.
const enter = () => location.replace(`./${location.search}#${view.join('&')}`);

/** What went wrong, for a person; the bridge words its refusals itself. */
const reasonOf = async (response) => {
  const body = await response.json().catch(() => ({}));
  return body.detail ?? words.refused.replace('%', response.status);
};

/** By a name and a password; without a name it is a token. */
const requestOf = (name, secret) =>
  name
    ? {
        headers: { 'Content-Type': 'application/json', 'X-Lupin-Twin': '1' },
        body: JSON.stringify({ name, password: secret }),
      }
    : { headers: { Authorization: `Bearer ${secret}`, 'X-Lupin-Twin': '1' } };

const signIn = async () => {
  const name = person.value.trim();
  const secret = name ? input.value : input.value.trim();
  if (!name && !/^[\w.~+/-]+=*$/.test(secret)) {
    return words.odd;
  }
  const response = await fetch('api/signin', { method: 'POST', ...requestOf(name, secret) });
  if (response.ok) {
    enter();
    return '';
  }
  return response.status === 401 ? words.wrong : reasonOf(response);
};

if (reason === 'ended') message.textContent = words.ended;

(person.hidden ? input : person).focus();

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
