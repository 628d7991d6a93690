"""Opens a page of `kiln run --report` in headless Chromium, uses it as a person would, and prints what it saw as JSON.

page_driver.py CHROMIUM PAGE FOLDER: pictures of the screen go to FOLDER. Chromium is driven through its own pipe
(--remote-debugging-pipe: JSON with a byte of 0 after each message), so that no port is opened.
"""
import base64
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time


class Browser:
    def __init__(self, program, profile):
        to_read, self.to = os.pipe()
        self.from_, from_write = os.pipe()
        command = [program, "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                   "--no-first-run", "--hide-scrollbars", "--force-color-profile=srgb",
                   f"--user-data-dir={profile}", "--remote-debugging-pipe", "about:blank"]
        # Chromium reads descriptor 3 and writes 4.
        self.process = subprocess.Popen(
            ["/bin/sh", "-c", f'exec "$@" 3<&{to_read} 4>&{from_write}', "sh", *command],
            pass_fds=(to_read, from_write), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_read)
        os.close(from_write)
        self.number, self.rest, self.session = 0, b"", None
        self.events = []

    def receive(self):
        while b"\0" not in self.rest:
            more = os.read(self.from_, 1 << 20)
            if not more:
                raise RuntimeError("Chromium ended")
            self.rest += more
        message, self.rest = self.rest.split(b"\0", 1)
        return json.loads(message)

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.receive()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def open(self, url):
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")
        self.call("Emulation.setDeviceMetricsOverride", width=1400, height=900, deviceScaleFactor=1, mobile=False)
        self.call("Page.navigate", url=url)
        self.wait("document.readyState === 'complete' && document.querySelector('#assets tbody') !== null")

    def value(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def wait(self, expression):
        for _ in range(600):
            if self.value(expression):
                return
            time.sleep(0.05)
        raise RuntimeError("never: " + expression)

    def click(self, selector, text=None):
        """A click of the mouse in the middle of what a selector, and the text of it, finds."""
        place = self.value(f"""(() => {{
          const all = [...document.querySelectorAll({json.dumps(selector)})];
          const text = {json.dumps(text)};
          const one = all.find((e) => text === null || e.textContent.trim() === text);
          if (!one) return null;
          one.scrollIntoView({{block: "center"}});
          const box = one.getBoundingClientRect();
          return [box.x + box.width / 2, box.y + box.height / 2];
        }})()""")
        if place is None:
            raise RuntimeError(f"there is no {selector} {text}")
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=place[0], y=place[1], button="left", clickCount=1)

    def picture(self, path):
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))

    def close(self):
        try:
            self.session = None
            self.call("Browser.close")
        except (RuntimeError, OSError):
            pass
        self.process.wait(30)


ROWS = "[...document.querySelectorAll('#assets tbody tr')].map((row) => row.dataset.asset)"
# Mean of each channel of the canvas: what is seen, not what was meant.
MEANS = """(() => {
  const canvas = document.querySelector('dialog canvas');
  const texels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  const sums = [0, 0, 0];
  for (let i = 0; i < texels.length; i += 4) for (let c = 0; c < 3; ++c) sums[c] += texels[i + c];
  return [canvas.width, canvas.height, ...sums.map((sum) => sum * 4 / texels.length)];
})()"""


def main():
    program, page, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3])
    seen = {}
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(program, profile)
        try:
            browser.open(page.as_uri())
            seen["rows"] = browser.value(ROWS)
            seen["title"] = browser.value("document.querySelector('h1').textContent")
            seen["columns"] = browser.value("[...document.querySelectorAll('#assets th')].map((th) => th.textContent)")
            seen["names"] = browser.value("[...document.querySelectorAll('td.name')].map((td) => td.firstChild.textContent)")
            seen["changes"] = browser.value("[...document.querySelectorAll('td.change')].map((td) => td.textContent)")
            seen["injected"] = browser.value("typeof window.injected !== 'undefined' || document.querySelector('#injected') !== null")
            # Lazy pictures are decoded once they are to be seen.
            browser.wait("[...document.images].slice(0, 4).every((image) => image.complete && image.naturalWidth > 0)")
            seen["pictures"] = browser.value("[...document.querySelectorAll('tbody tr')].map((row) => row.querySelectorAll('img').length)")
            browser.picture(folder / "page.png")
            for column in ("Asset", "Asset", "Seconds"):
                browser.click("#assets th button", column)
                seen.setdefault("sorted", []).append(browser.value(ROWS))
            seen["seconds"] = browser.value("report.assets.map((asset) => [asset.asset, asset.seconds])")
            browser.click("#assets th button", "Asset")
            if browser.value("document.querySelector('th[aria-sort]').ariaSort") == "descending":
                browser.click("#assets th button", "Asset")
            browser.click("#filter")
            browser.call("Input.insertText", text=sys.argv[4])
            seen["filtered"] = browser.value(ROWS)
            browser.value("document.querySelector('#filter').value = ''; refresh()")
            if browser.value("document.querySelector('details summary') !== null"):
                browser.click("details summary")
                seen["warning"] = browser.value("document.querySelector('details').open && document.querySelector('details li').textContent")
            seen["channels"] = {}
            if browser.value("document.querySelector('.maps .look') !== null"):
                browser.click(".maps .look")
                browser.wait("document.querySelector('dialog').open && document.querySelector('canvas').dataset.shown === '-1'")
                seen["large"] = browser.value("document.querySelector('dialog strong').textContent")
                seen["link"] = browser.value("document.querySelector('dialog a')?.getAttribute('href') ?? null")
                browser.picture(folder / "map.png")
                names = browser.value("[...document.querySelectorAll('dialog .bar button')].map((b) => b.textContent)")
                for number, name in [("-1", "all"), ("0", "R"), ("1", "G"), ("2", "B"), ("3", "A")]:
                    if name not in names:
                        continue
                    browser.click("dialog .bar button", name)
                    browser.wait(f"document.querySelector('canvas').dataset.shown === '{number}'")
                    seen["channels"][name] = browser.value(MEANS)
                if "before" in names:
                    browser.click("dialog .bar button", "all")
                    browser.wait("document.querySelector('canvas').dataset.shown === '-1'")
                    browser.value("delete document.querySelector('canvas').dataset.shown")
                    browser.click("dialog .bar button", "before")
                    browser.wait("document.querySelector('canvas').dataset.shown === '-1'")
                    seen["before"] = browser.value(MEANS)
                browser.click("dialog .bar button", "\u2715")
                seen["closed"] = not browser.value("document.querySelector('dialog').open")
            if browser.value("document.querySelector('td .look') !== null"):
                browser.value("delete document.querySelector('canvas').dataset.shown")
                browser.value("[...document.querySelectorAll('td .look')].find((b) => b.title.endsWith('error of rendered normals'))?.click()")
                browser.wait("document.querySelector('canvas').dataset.shown === '-1'")
                browser.picture(folder / "error.png")
        finally:
            browser.close()
    requests = [event["params"]["request"]["url"] for event in browser.events
                if event.get("method") == "Network.requestWillBeSent"]
    seen["requests"] = [url for url in requests if not url.startswith(("data:", "file:"))]
    seen["files"] = sorted({url for url in requests if url.startswith("file:")})
    seen["problems"] = [event["params"] for event in browser.events
                        if event.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded")]
    print(json.dumps(seen))


if __name__ == "__main__":
    main()
