"""Runs a command beside a server of results, made of Python's http.server, and ends as the command does.

cache_server.py MODE FOLDER LOG COMMAND...: "{url}" in the command becomes the server's address. Calls go to LOG, a line
each. Modes: plain; denying (500 to all); cutting (half of each body); hanging up (no answer); changing (a byte is another).
"""
import http.server
import os
import pathlib
import subprocess
import sys
import threading

mode, folder, log = sys.argv[1], pathlib.Path(sys.argv[2]), open(sys.argv[3], "a", buffering=1)


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def answer(self, status, body=b""):
        log.write(f"{self.command} {self.path} {status}\n")
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def broken(self):
        if mode == "hanging up":
            self.close_connection = True
            return True
        if mode == "denying":
            self.rfile.read(int(self.headers.get("Content-Length", 0)))
            self.answer(500)
            return True
        return False

    def do_GET(self):
        if self.broken():
            return
        path = folder / self.path.lstrip("/")
        if not path.is_file():
            self.answer(404)
            return
        body = path.read_bytes()
        if mode == "cutting":
            body = body[:len(body) // 2]
        if mode == "changing":
            middle = len(body) // 2
            body = body[:middle] + bytes([body[middle] ^ 1]) + body[middle + 1:]
        self.answer(200, body)

    def do_PUT(self):
        if self.broken():
            return
        path = folder / self.path.lstrip("/")
        path.parent.mkdir(parents=True, exist_ok=True)
        body = self.rfile.read(int(self.headers["Content-Length"]))
        written = path.with_name(f"{path.name}.{threading.get_ident()}")
        written.write_bytes(body)
        os.replace(written, path)
        self.answer(201)

    def log_message(self, *_):
        pass


server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
threading.Thread(target=server.serve_forever, daemon=True).start()
url = f"http://127.0.0.1:{server.server_port}/results"
environment = {name: value for name, value in os.environ.items() if not name.lower().endswith("_proxy")}
result = subprocess.run([word.replace("{url}", url) for word in sys.argv[4:]], env=environment)
server.shutdown()
sys.exit(result.returncode)
