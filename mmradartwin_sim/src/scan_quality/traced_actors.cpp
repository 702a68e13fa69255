#include "scan_quality/traced_actors.h"

namespace mmradartwin {

Scene tracedActors(const ScanScene& scan) {
  Scene scene;
  scene.file = "scene of the scan";
  for (const ScanActor& a : scan.actors) {
    Actor actor;
    actor.name = a.name;
    actor.vertices = a.vertices;
    actor.triangles = a.triangles;
    scene.actors.push_back(std::move(actor));
  }
  rebuildFacets(scene);
  return scene;
}

}  // namespace mmradartwin
