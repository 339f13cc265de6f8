// Loads the scene into the viewer of vtk.js, and lets keys do what the mouse does.
(() => {
  'use strict';
  const STEP = 5; // degrees
  const ZOOM = 1.15;
  const container = document.querySelector('.content');
  let start = null; // where the camera stood at first

  const renderer = () => window.global.renderWindow && window.global.renderWindow.getRenderers()[0]; // the scene's, once there is one

  function draw() {
    renderer().resetCameraClippingRange();
    window.global.renderWindow.render();
  }

  function pose(camera) {
    return { position: camera.getPosition(), focalPoint: camera.getFocalPoint(), viewUp: camera.getViewUp() };
  }

  function turn(camera, azimuth, elevation) {
    if (azimuth) camera.azimuth(azimuth);
    if (elevation) {
      camera.elevation(elevation);
      camera.orthogonalizeViewUp();
    }
  }

  const KEYS = {
    ArrowLeft: (camera) => turn(camera, STEP, 0),
    ArrowRight: (camera) => turn(camera, -STEP, 0),
    ArrowUp: (camera) => turn(camera, 0, -STEP),
    ArrowDown: (camera) => turn(camera, 0, STEP),
    '+': (camera) => camera.dolly(ZOOM),
    '=': (camera) => camera.dolly(ZOOM),
    '-': (camera) => camera.dolly(1 / ZOOM),
    r: (camera) => camera.set(start),
    R: (camera) => camera.set(start),
  };

  function onKey(event) {
    const act = KEYS[event.key];
    if (!act || !start || event.ctrlKey || event.altKey || event.metaKey) return;
    act(renderer().getActiveCamera());
    draw();
    event.preventDefault();
    event.stopImmediatePropagation(); // the viewer has keys of its own
  }

  // Arrays arrive one by one: all of them are there once all points are.
  function points() {
    const found = renderer();
    const data = found ? found.getActors().map((actor) => actor.getMapper() && actor.getMapper().getInputData()) : [];
    return data.reduce((sum, one) => sum + (one && one.getPoints() ? one.getPoints().getNumberOfPoints() : 0), 0);
  }

  function whenLoaded() {
    if (points() < window.pathspacePoints) {
      setTimeout(whenLoaded, 30);
      return;
    }
    const found = renderer();
    start = pose(found.getActiveCamera());
    draw();
    document.documentElement.dataset.ready = 'true';
  }

  window.addEventListener('keydown', onKey, true);
  window.loadDataSet = () => {
    // A frame that is off the screen may have no size yet, and nothing can be drawn on nothing.
    if (!container.clientWidth || !container.clientHeight) {
      setTimeout(window.loadDataSet, 50);
      return;
    }
    window.OfflineLocalView.load(container, { base64Str: window.pathspaceScene });
    const scale = window.devicePixelRatio || 1;
    const size = [container.clientWidth, container.clientHeight].map((side) => Math.max(1, Math.floor(scale * side)));
    window.global.renderWindow.getViews().forEach((view) => view.setSize(...size)); // else the first picture is one of no size
    window.global.renderWindow.getRenderers().slice().forEach((empty) => window.global.renderWindow.removeRenderer(empty));
    whenLoaded();
  };
})();
