// The connection to the program: connects, reconnects, and sends the page's requests.

const kFirstWait_ms = 500, kMaxWait_ms = 4000;

/// The token of the printed address; kept for reloads and removed from the address bar.
function takeToken() {
  const url = new URL(location.href);
  const token = url.searchParams.get('token');
  if (token) {
    sessionStorage.setItem('token', token);
    url.searchParams.delete('token');
    history.replaceState(null, '', url);
  }
  return sessionStorage.getItem('token');
}

export class Connection {
  /// \param handlers  {hello(scene), frame(buffer), state(name)}; state is 'connecting', 'live' or 'lost'
  constructor(handlers) {
    this.handlers = handlers;
    this.wait_ms = kFirstWait_ms;
    this.token = takeToken();
    this.#connect();
  }

  /// Sends a request to the program, as ViewRequest in view_request.hpp reads it.
  send(...words) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(words.join(' '));
  }

  #connect() {
    const query = this.token ? `?token=${encodeURIComponent(this.token)}` : '';
    this.socket = new WebSocket(`ws://${location.host}/socket${query}`);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onmessage = ({ data }) => {
      if (typeof data !== 'string') { this.handlers.frame(data); return; }
      this.wait_ms = kFirstWait_ms;
      this.handlers.hello(JSON.parse(data));
      this.handlers.state('live');
    };
    this.socket.onclose = () => {
      this.handlers.state('lost');
      setTimeout(() => this.#connect(), this.wait_ms);
      this.wait_ms = Math.min(this.wait_ms * 1.5, kMaxWait_ms);
    };
  }
}
