#include "scene/required_actor.h"

#include <set>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

int requireActor(const Scene& scene, const std::string& mechanism, const std::string& actor) {
  const int index = scene.actorIndex(actor);
  if (index >= 0) return index;
  throw InputError("mechanism " + mechanism + ": key actor: " + scene.file + " has no actor " + actor +
                   "; known: " + scene.knownActors());
}

std::vector<bool> requireMaterial(const Scene& scene, const std::string& mechanism, const std::string& material) {
  std::vector<bool> of(scene.actors.size(), false);
  bool any = false;
  std::set<std::string> tags;
  for (std::size_t i = 0; i < scene.actors.size(); ++i) {
    of[i] = scene.actors[i].material_tag == material;
    any = any || of[i];
    tags.insert(scene.actors[i].material_tag);
  }
  if (any) return of;
  std::string known;
  for (const std::string& tag : tags) known += (known.empty() ? "" : ", ") + tag;
  throw InputError("mechanism " + mechanism + ": key material: no actor of " + scene.file + " is of " + material +
                   "; its materials: " + known);
}

}  // namespace mmradartwin
