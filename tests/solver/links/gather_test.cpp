// The gather: a link of each kind brings what its kernel makes of the light of
// the source.

#include "solver/links/gather.h"

#include "base/random.h"
#include "solver/elements/received_light.h"
#include "solver/links/link_codes.h"
#include "solver/transfer/form_factor.h"

#include <array>
#include <cstdint>
#include <numeric>
#include <vector>

#include "tests/solver/test_cells.h"
#include "tests/solver/test_refinement.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::BrightCell;

constexpr int kCases = 200;
constexpr uint32_t kReceiver = 0;
constexpr uint32_t kSource = 1;

// Two patches that see each other, each a parallelogram or a triangle, which
// send random light.
class RandomPairOfPatches {
 public:
  RandomPairOfPatches(const Basis& basis, Random* random)
      : random_(random), cell_(0, basis, {Draw(0), Draw(2)}) {
    for (size_t i = 0; i < cell_.Tree().Size(); ++i) {
      for (float& b : cell_.Tree().Sent()[ElementId(i)]) {
        b = static_cast<float>(random->Next());
      }
    }
  }

  // What the receiver's nodes get by one link, [channel][node].
  std::vector<float> Gathered(const LinkBlock& block) {
    ReceivedLight received(cell_.Tree().Shape());
    received.GrowTo(cell_.Tree().Size());
    CoefficientArray& gathered = received.gathered;
    Gather(block,
           {cell_.Geometry(), &cell_.Tree(), nullptr},
           {cell_.Geometry(), &cell_.Tree(), nullptr},
           cell_.Tree().Sent(),
           gathered);
    const auto values = gathered[ElementId(kReceiver)];
    return {values.begin(), values.end()};
  }

  // The same, computed with a kernel [receiver node][source node].
  std::vector<float> Expected(const Kernel& kernel) {
    std::vector<float> values;
    const auto sent = cell_.Tree().Sent()[ElementId(kSource)];
    for (size_t c = 0; c < kRgbChannels; ++c) {
      for (size_t g = 0; g < kTransferNodes; ++g) {
        double sum = 0;
        for (size_t q = 0; q < kTransferNodes; ++q) {
          sum += static_cast<double>(kernel[g * kTransferNodes + q]) *
                 static_cast<double>(sent[c * kTransferNodes + q]);
        }
        values.push_back(static_cast<float>(sum));
      }
    }
    return values;
  }

  [[nodiscard]] TransferEnd End(uint32_t patch) const {
    return MakeTransferEnd(cell_.Geometry()[patch], {});
  }

 private:
  // Draws a patch about one metre large at `height`, with its front towards the
  // other patch.
  Patch Draw(double height) {
    const auto off = [this] { return 0.6 * (random_->Next() - 0.5); };
    const Vec3 u{1 + off(), off(), off()};
    const Vec3 v{off(), 1 + off(), off()};
    Patch patch = height > 0 ? test::Rectangle({off(), off(), height}, v, u)
                             : test::Rectangle({off(), off(), 0}, u, v);
    patch.shape = random_->NextBelow(2) == 0 ? PatchShape::kTriangle
                                             : PatchShape::kParallelogram;
    return patch;
  }

  Random* random_;
  BrightCell cell_;
};

void ExpectNear(const std::vector<float>& gathered,
                const std::vector<float>& expected,
                size_t nodes) {
  ASSERT_EQ(gathered.size(), expected.size());
  for (size_t i = 0; i < expected.size(); ++i) {
    if (i % kTransferNodes < nodes) {
      EXPECT_NEAR(gathered[i], expected[i], 1e-6F * (1 + expected[i])) << i;
    }
  }
}

class GatheredLink : public ::testing::Test {
 protected:
  template <typename Check>
  void ForEachCase(const Check& check) {
    for (int i = 0; i < kCases; ++i) {
      RandomPairOfPatches pair(basis_, &random_);
      check(pair);
    }
  }

  Kernel RandomKernel() {
    Kernel kernel{};
    for (float& k : kernel) {
      k = static_cast<float>(random_.Next());
    }
    return kernel;
  }

  static Kernel ByRows(const KernelColumns& columns) {
    Kernel kernel{};
    for (size_t i = 0; i < kernel.size(); ++i) {
      kernel[i] = columns[i % kTransferNodes][i / kTransferNodes];
    }
    return kernel;
  }

  const Basis basis_{2};
  Random random_{11};
};

TEST_F(GatheredLink, FarBringsWhatIsVisibleOfTheQuadrature) {
  ForEachCase([this](RandomPairOfPatches& pair) {
    const auto visible = static_cast<uint16_t>(random_.NextBelow(1U << 16));
    const TransferEnd r = pair.End(kReceiver);
    Kernel kernel = QuadratureKernel(r, pair.End(kSource));
    MaskKernel(visible, &kernel);
    LinkBlock block;
    block.links = {{kReceiver, kSource, LinkKind::kFar, 0, visible}};
    ExpectNear(pair.Gathered(block), pair.Expected(kernel), r.node_count);
  });
}

// A near link brings the quadrature of the visible node pairs, scaled to the
// stored sum.
TEST_F(GatheredLink, NearBringsTheQuadratureScaledToItsSum) {
  ForEachCase([this](RandomPairOfPatches& pair) {
    const auto visible = static_cast<uint16_t>(random_.NextBelow(1U << 16));
    const uint16_t sum = EncodeCoefficient(static_cast<float>(random_.Next()));
    const TransferEnd r = pair.End(kReceiver);
    Kernel kernel = QuadratureKernel(r, pair.End(kSource));
    MaskKernel(visible, &kernel);
    const float total = std::accumulate(kernel.begin(), kernel.end(), 0.0F);
    for (float& k : kernel) {
      k *= total > 0 ? DecodeCoefficient(sum) / total : 0.0F;
    }
    LinkBlock block;
    block.links = {{kReceiver, kSource, LinkKind::kNear, sum, visible}};
    ExpectNear(pair.Gathered(block), pair.Expected(kernel), r.node_count);
  });
}

TEST_F(GatheredLink, ShapedBringsWhatItsCodeSays) {
  ForEachCase([this](RandomPairOfPatches& pair) {
    const EncodedKernel encoded = EncodeKernel(RandomKernel());
    LinkBlock block;
    block.links = {{kReceiver, kSource, LinkKind::kShaped, encoded.sum, 0}};
    block.shapes = {encoded.shape};
    ExpectNear(pair.Gathered(block),
               pair.Expected(ByRows(DecodeKernel(encoded.sum, encoded.shape))),
               kTransferNodes);
  });
}

// A weak link brings the mean of the source to all nodes of the receiver, and
// to no others.
TEST_F(GatheredLink, WeakBringsTheMean) {
  ForEachCase([this](RandomPairOfPatches& pair) {
    const uint16_t code = EncodeCoefficient(static_cast<float>(random_.Next()));
    const size_t nodes = pair.End(kReceiver).node_count;
    const size_t sent = pair.End(kSource).node_count;
    Kernel kernel{};
    for (size_t g = 0; g < nodes; ++g) {
      for (size_t q = 0; q < sent; ++q) {
        kernel[g * kTransferNodes + q] =
            DecodeCoefficient(code) / static_cast<float>(sent);
      }
    }
    LinkBlock block;
    block.links = {{kReceiver, kSource, LinkKind::kWeak, code, 0}};
    ExpectNear(pair.Gathered(block), pair.Expected(kernel), kTransferNodes);
  });
}

}  // namespace
}  // namespace enfilade
