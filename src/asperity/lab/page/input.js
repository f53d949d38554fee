// The pointer in the views, and the keys.

const $ = id => document.getElementById(id);
const ARROW_DIRECTIONS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const MAX_KEY_HEIGHT = 0.01; // m
const ZOOM_FACTOR = 1.15;

/** Let the pointer move the hand in a view; moveHand(event) sets the position of the hand. */
export function followPointer(canvas, host, moveHand) {
  const { hand } = host;
  let lastInput = "";
  const follow = event => {
    // A browser also sends pointermove after a change of the layout, which must not override the keys.
    const input = [event.offsetX, event.offsetY, event.buttons, event.pressure].join();
    if (input === lastInput) return;
    lastInput = input;
    if (hand.motion !== "pointer" || !host.canFollowPointer) return;
    hand.isPressed = event.buttons > 0;
    hand.pressure = event.pointerType === "pen" ? 2 * event.pressure : 1;
    moveHand(event);
    hand.requestMotion();
  };
  canvas.onpointerdown = event => { canvas.setPointerCapture(event.pointerId); follow(event); };
  canvas.onpointermove = canvas.onpointerup = follow;
  // Where supported, raw updates are sent at once; pointermove waits for the next animation frame.
  canvas.addEventListener("pointerrawupdate", follow);
  canvas.onpointercancel = () => { hand.isPressed = false; hand.requestMotion(); };
  canvas.addEventListener("wheel", event => { event.preventDefault(); host.zoom(ZOOM_FACTOR ** Math.sign(event.deltaY)); }, { passive: false });
}

/** Return the action of each key. */
function keyActions(host) {
  const { hand, handle, tour } = host;
  return {
    " ": () => { hand.z = null; hand.pressure = 1; hand.isLatched = !hand.isLatched; hand.requestMotion(); },
    PageUp: () => { hand.z = Math.min(hand.height + host.viewWidth / 80, MAX_KEY_HEIGHT); hand.requestMotion(); },
    PageDown: () => { hand.z = Math.max(hand.height - host.viewWidth / 80, -MAX_KEY_HEIGHT); hand.requestMotion(); },
    m: () => handle.isPresent || host.motionPanel.choose(hand.nextMotion),
    2: () => handle.isPresent || host.secondLane.toggle(), x: () => $("swap-laws").click(), r: () => $("reset-energy").click(), s: () => $("sound").click(),
    t: () => handle.isPresent || $("tour-start").click(), v: () => tour.isActive && $("tour-demo").click(),
    n: () => tour.isActive && $("tour-next").click(), p: () => tour.isActive && $("tour-back").click(),
    "+": () => host.zoom(1 / ZOOM_FACTOR), "-": () => host.zoom(ZOOM_FACTOR),
  };
}

/**
 * Obey the keys.
 * @param host object with hand, handle, tour, motionPanel, secondLane, viewWidth [m], hasControl and zoom(factor)
 */
export function obeyKeys(host) {
  const { hand } = host, actions = keyActions(host);
  addEventListener("keydown", event => {
    const isTyping = event.target.closest("input:not([type=range]), select, textarea");
    if (isTyping || event.ctrlKey || event.altKey || event.metaKey) return;
    const { key } = event, direction = ARROW_DIRECTIONS[key], isSlider = event.target.matches("input[type=range]");
    const lawButton = [...$("law-buttons").children].find(button => button.textContent === key.toUpperCase());
    const activatesButton = event.target.closest("button, summary") && key === " ";
    if (direction && !isSlider) {
      hand.x += direction[0] * host.viewWidth / 60;
      hand.y += direction[1] * host.viewWidth / 60;
      hand.requestMotion();
    } else if (actions[key] && !activatesButton && !(isSlider && key.startsWith("Page"))) actions[key]();
    else if (lawButton) { if (host.hasControl) lawButton.click(); } else return;
    event.preventDefault();
  });
}
