import { describePage, EMPTY_STATUS } from '../page_status';
import { hasToken, useToken } from '../server/access';
import { element } from './dom';
import type { Page } from './page';

/** Asks for the access token that the server wants. */
export class AccessPage implements Page {
  readonly root = element('main', { class: 'list', 'data-page': 'access' });
  readonly heading = element('h1', {}, 'Access');
  private readonly token = element('input', {
    type: 'password',
    required: '',
    autocomplete: 'off',
    spellcheck: 'false',
    'aria-label': 'Access token',
    placeholder: 'Access token',
  });

  /** `why` is the server's reason; `given` is called once there is a token to try. */
  constructor(why: string, given: () => void) {
    const refused = hasToken() ? `The server refuses this token: ${why}.` : '';
    const form = element(
      'form',
      { class: 'access card' },
      element('h2', {}, 'This server wants an access token'),
      element('p', {}, 'Whoever runs the server makes one for you. It is kept until this tab is closed.'),
      element('p', { class: 'problem', role: 'alert' }, refused),
      this.token,
      element('button', { type: 'submit', class: 'button' }, 'Continue'),
    );
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      useToken(this.token.value);
      given();
    });
    this.root.append(form);
    document.title = 'MIS-SLAM · Access';
    describePage(() => ({ ...EMPTY_STATUS, page: 'access' }));
  }

  /** To be called once it is on the screen. */
  shown(): void {
    this.token.focus();
  }

  close(): void {
    // It holds nothing.
  }
}
