#include "partition/patch.h"

namespace enfilade {
namespace {

// Flag bits of a stored patch.
constexpr uint8_t kTriangleBit = 1;
constexpr uint8_t kEmitsBit = 2;
constexpr uint8_t kReflectsBit = 4;
constexpr uint8_t kTwinBit = 8;
constexpr uint8_t kBackBit = 16;
constexpr uint8_t kEnclosedBit = 32;

uint8_t FlagsOf(const Patch& p) {
  return static_cast<uint8_t>(
      (p.shape == PatchShape::kTriangle ? kTriangleBit : 0) |
      (p.emits ? kEmitsBit : 0) | (p.reflects ? kReflectsBit : 0) |
      (p.is_twin ? kTwinBit : 0) | (p.is_back ? kBackBit : 0) |
      (p.is_enclosed ? kEnclosedBit : 0));
}

void SetFlags(uint8_t flags, Patch& p) {
  p.shape = (flags & kTriangleBit) != 0 ? PatchShape::kTriangle
                                        : PatchShape::kParallelogram;
  p.emits = (flags & kEmitsBit) != 0;
  p.reflects = (flags & kReflectsBit) != 0;
  p.is_twin = (flags & kTwinBit) != 0;
  p.is_back = (flags & kBackBit) != 0;
  p.is_enclosed = (flags & kEnclosedBit) != 0;
}

}  // namespace

Bytes EncodeCellPatches(const CellPatches& cell) {
  ByteWriter writer;
  writer.Put(cell.bounds);
  writer.PutVarint(cell.patches.size());
  for (const Patch& p : cell.patches) {
    writer.Put(p.origin);
    writer.Put(p.u);
    writer.Put(p.v);
    writer.PutVarint(p.material.value);
    writer.PutVarint(p.face.value);
    writer.Put(FlagsOf(p));
    writer.Put(p.layer);
  }
  return writer.Take();
}

CellPatches DecodeCellPatches(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  CellPatches cell;
  cell.bounds = reader.Get<Box3>();
  const uint64_t count = reader.GetVarint();
  constexpr size_t kLeastPatchBytes = 9 * sizeof(double) + 4;
  if (count > reader.Remaining() / kLeastPatchBytes) {
    throw DamagedStoreError("it ends before its last patch");
  }
  cell.patches.resize(count);
  for (Patch& p : cell.patches) {
    p.origin = reader.Get<Point3>();
    p.u = reader.Get<Vec3>();
    p.v = reader.Get<Vec3>();
    p.material = MaterialId(static_cast<uint32_t>(reader.GetVarint()));
    p.face = FaceId(static_cast<uint32_t>(reader.GetVarint()));
    SetFlags(reader.Get<uint8_t>(), p);
    p.layer = reader.Get<uint8_t>();
  }
  reader.RequireEnd();
  return cell;
}

CellPatches LoadCellPatches(const BlockStorage& store, CellId cell) {
  return ReadBlock(
      store, {BlockKind::kCellPatches, cell.value}, [](ByteReader& in) {
        return DecodeCellPatches(in.TakeRest());
      });
}

}  // namespace enfilade
