// The seam between the layers that have data and the store that keeps it:
// blocks of bytes by key, in transactions. The layers below the solver know
// only this interface; src/store implements it on disk (sqlite_store.h).

#pragma once

#include "base/bytes.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace enfilade {

// What a block holds, and what the parts a, b and c of its key count; a part
// that is not listed is 0. The values are part of the file format: never
// renumber. docs/store-format.md names the header that describes each kind.
enum class BlockKind : uint8_t {
  kFaces = 1,        // cleaned polygons of the scene; a = chunk
  kCellPatches = 2,  // a = cell
  kPortals = 3,      // a = chunk; b = 0 portals, 1 the tree of planes, 2 the
                     // cell of each convex region, 3 openings between regions
  kVisibleSet = 4,   // a = receiver cell
  kCellTree = 5,     // a = cell; b = 0 elements, 1 what they send, c = page
  kLinks = 6,        // a = receiver cell, b = source cell, c = chunk
  kTrace = 7,        // triangles for tracing; a = 0 the table, 1 + i chunk i
  kScratch = 8,      // working data, erased before the next commit
  kSolveCells = 9,   // the solve's table of cells; one block
  kCellCare = 10,    // how carefully patches are refined; a = cell
  kReceived = 11,    // what the elements of a cell have received; a = cell,
                     // b = 0 irradiance, 1 gains, 2 while the cell is being
                     // refined: the irradiance before refinement; c = page
  kCellDelta = 12,   // the last change of what a cell sends; a = cell,
                     // c = page
  kSourceWeights = 13,  // what a cell sends at most, for refinement; a = cell
};

struct BlockKey {
  BlockKind kind{};
  uint32_t a = 0;
  uint32_t b = 0;
  uint32_t c = 0;

  // NOLINTNEXTLINE(modernize-use-nullptr): see base/ids.h
  friend auto operator<=>(const BlockKey&, const BlockKey&) = default;
};

// "links 3 4 0", for messages.
std::string ToString(const BlockKey& key);

struct StoreStats {
  uint64_t bytes_read = 0;     // compressed bytes of blocks fetched
  uint64_t bytes_written = 0;  // compressed bytes of blocks put
};

// All members throw DiskError (open, full disk, I/O) or DamagedStoreError; Put
// also DoesNotFitError.
// Thread-safe: calls are serialised, but (de)compression runs outside the lock.
class BlockStorage {
 public:
  virtual ~BlockStorage() = default;

  // What messages call it: its path, if it is a file.
  [[nodiscard]] virtual std::string Name() const { return "the store"; }

  // Small named values: settings, schedule state, JSON. Part of transactions.
  virtual void SetMeta(std::string_view name, std::string_view value) = 0;
  [[nodiscard]] virtual std::optional<std::string> Meta(
      std::string_view name) const = 0;

  // Adds or replaces a block; returns its compressed bytes. Throws
  // DoesNotFitError if it has more than 64 MiB: the model is then too large to
  // be solved whole.
  virtual uint64_t Put(const BlockKey& key,
                       std::span<const std::byte> content) = 0;

  // The block's content, checked; nullopt if there is no such block.
  [[nodiscard]] virtual std::optional<Bytes> Get(const BlockKey& key) const = 0;

  // Like Get, but throws DamagedStoreError naming the key if there is no block.
  [[nodiscard]] Bytes GetOrThrow(const BlockKey& key) const;

  virtual void Erase(const BlockKey& key) = 0;

  // Erases every block of a kind, or of a kind and its first component(s).
  virtual void EraseAll(BlockKind kind) = 0;
  virtual void EraseAll(BlockKind kind, uint32_t a) = 0;
  virtual void EraseAll(BlockKind kind, uint32_t a, uint32_t b) = 0;

  // Number of blocks, and their compressed bytes, of a kind.
  [[nodiscard]] virtual uint64_t Count(BlockKind kind) const = 0;
  [[nodiscard]] virtual uint64_t StoredBytes(BlockKind kind) const = 0;

  // Number of blocks of kind with these first components (chunks of a pair).
  [[nodiscard]] virtual uint64_t Count(BlockKind kind,
                                       uint32_t a,
                                       uint32_t b) const = 0;

  // Visits the keys of a kind in ascending order, without reading contents.
  virtual void ForEachKey(
      BlockKind kind,
      const std::function<void(const BlockKey&)>& visit) const = 0;

  // Makes all changes since the last commit durable in one atomic step.
  virtual void Commit() = 0;

  // Reads all there is and tests every checksum. Throws DamagedStoreError at
  // the first that is wrong, otherwise returns the number of blocks. `progress`
  // is told the fraction done after each block and may be empty.
  virtual uint64_t VerifyAll(
      const std::function<void(double fraction)>& progress) const = 0;

  [[nodiscard]] virtual StoreStats Stats() const = 0;
  [[nodiscard]] virtual uint64_t FileBytes() const = 0;
};

// Throws DamagedStoreError, which names the store, says what is wrong with it
// ("holds no scene") and what to do.
[[noreturn]] void ThrowDamaged(const BlockStorage& store,
                               std::string_view what);

namespace internal {

[[noreturn]] void ThrowDamagedContent(const BlockStorage& store,
                                      const BlockKey& key,
                                      const DamagedStoreError& why);
[[noreturn]] void ThrowDamagedContent(const BlockStorage& store,
                                      std::string_view meta_entry,
                                      const DamagedStoreError& why);

// `key` is a BlockKey or the name of a meta entry.
template <typename Key, typename Read>
auto ReadContent(const BlockStorage& store,
                 const Key& key,
                 std::span<const std::byte> content,
                 const Read& read) {
  try {
    ByteReader in(content);
    auto value = read(in);
    in.RequireEnd();
    return value;
  } catch (const DamagedStoreError& why) {
    ThrowDamagedContent(store, key, why);
  }
}

}  // namespace internal

// The value that read(ByteReader&) makes of a block's content, all of which it
// must read. What it finds wrong, it says of "it", the block, by a
// DamagedStoreError; the error that is thrown then names store and block too.
// Throws DamagedStoreError if there is no block.
template <typename Read>
auto ReadBlock(const BlockStorage& store,
               const BlockKey& key,
               const Read& read) {
  return internal::ReadContent(store, key, store.GetOrThrow(key), read);
}

// As ReadBlock(); nullopt if there is no block.
template <typename Read>
auto ReadBlockIfAny(const BlockStorage& store,
                    const BlockKey& key,
                    const Read& read)
    -> std::optional<decltype(read(std::declval<ByteReader&>()))> {
  const auto content = store.Get(key);
  if (!content) {
    return std::nullopt;
  }
  return internal::ReadContent(store, key, *content, read);
}

// The same of a meta entry that a ByteWriter wrote.
template <typename Read>
auto ReadPackedMeta(const BlockStorage& store,
                    std::string_view name,
                    const Read& read)
    -> std::optional<decltype(read(std::declval<ByteReader&>()))> {
  const auto text = store.Meta(name);
  if (!text) {
    return std::nullopt;
  }
  return internal::ReadContent(
      store, name, std::as_bytes(std::span<const char>(*text)), read);
}

}  // namespace enfilade
