#include "scene/gbxml_reader.h"

#include "base/error.h"

namespace enfilade {

void ReadGbxml(const std::filesystem::path& path,
               MaterialTable& /*materials*/,
               MemoryBudget& /*budget*/,
               SceneWriter& /*writer*/,
               SceneInfo& /*info*/) {
  throw InputError(path.string() + ": gbXML is not read yet");
}

}  // namespace enfilade
