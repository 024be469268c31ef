// Draws the frames of each movie, which are pictures in the page, on a canvas.
'use strict';
document.querySelectorAll('.movie').forEach(figure => {
  const frames = [...figure.querySelectorAll('.frames img')];
  const canvas = figure.querySelector('canvas');
  const values = [...figure.querySelectorAll('.views .value')];
  const context = canvas.getContext('2d');
  let shown = 0;

  const draw = index => {
    const frame = frames[index];
    shown = index;
    if (frame.complete) {
      context.drawImage(frame, 0, 0, canvas.width, canvas.height);
      // Decoded ahead of its turn, the next picture costs nothing when it is drawn.
      frames[(index + 1) % frames.length].decode().catch(() => {});
    } else {
      frame.addEventListener('load', () => { if (shown === index) draw(index); }, { once: true });
    }
    const texts = frame.dataset.values.split('|');
    values.forEach((value, i) => { value.textContent = texts[i] || ''; });
  };
  canvas.hidden = false;
  draw(0);

  const controls = figure.querySelector('.controls');
  if (!controls) return;
  controls.hidden = false;
  const [play, speed] = controls.querySelectorAll('button');
  const scrub = controls.querySelector('input');
  const time = controls.querySelector('output');
  const fps = Number(figure.dataset.fps);
  const speeds = [[1, '1×'], [0.5, '½×'], [0.25, '¼×']];
  let rate = 0;
  let playing = false;
  let position = 0; // in frames
  let before = 0;

  const show = index => {
    draw(index);
    scrub.value = index;
    time.textContent = frames[index].dataset.time;
  };
  const tick = now => {
    if (!playing) return;
    // A frame's time may lie a little before the click that started the movie, and long after the
    // last one where the tab was in the background.
    const passed = Math.min(Math.max((now - before) / 1000, 0), 0.25);
    before = now;
    position = (position + passed * fps * speeds[rate][0]) % frames.length;
    if (Math.floor(position) !== shown) show(Math.floor(position));
    requestAnimationFrame(tick);
  };
  const setPlaying = on => {
    if (on === playing) return;
    playing = on;
    play.textContent = on ? '❚❚' : '▶';
    before = performance.now();
    if (on) requestAnimationFrame(tick);
  };
  play.addEventListener('click', () => { wanted = !playing; setPlaying(wanted); });
  scrub.addEventListener('input', () => {
    wanted = false;
    setPlaying(false);
    position = Number(scrub.value);
    show(position);
  });
  speed.addEventListener('click', () => {
    rate = (rate + 1) % speeds.length;
    speed.textContent = speeds[rate][1];
  });

  // Movies play while they are seen, unless the reader has paused them or wants no motion.
  let wanted = !matchMedia('(prefers-reduced-motion: reduce)').matches;
  new IntersectionObserver(entries => {
    setPlaying(wanted && entries[entries.length - 1].isIntersecting);
  }, { threshold: 0.3 }).observe(canvas);
});
