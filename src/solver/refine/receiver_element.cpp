#include "solver/refine/receiver_element.h"

namespace enfilade {

ReceiverElement RootReceiver(const RefineReceiver& receiver,
                             const ClusterItem& item) {
  const PatchGeometry& patch = receiver.patches[item.patch];
  ReceiverElement r;
  r.end = MakeTransferEnd(patch, FrameOfPath(patch.shape, item.path));
  r.patch = item.patch;
  r.path = item.path;
  r.care = CareOf(receiver.care, item.patch);
  r.weight = WeightOf(patch, r.end.frame, r.care, receiver.least_reflectance);
  return r;
}

ReceiverElement ChildReceiver(const ReceiverElement& parent, size_t child) {
  ReceiverElement r;
  const PatchGeometry& patch = *parent.end.patch;
  r.end = MakeTransferEnd(patch, ChildOf(parent.end.frame, patch.shape, child));
  r.patch = parent.patch;
  r.path = ChildPath(parent.path, child);
  r.level = parent.level + 1;
  r.care = parent.care;
  r.weight = 0.5F * parent.weight;
  return r;
}

}  // namespace enfilade
