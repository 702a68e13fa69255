#include "mmradartwin_driver/dropping_worker_queue.h"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <vector>

namespace mmradartwin {
namespace {

TEST(DroppingWorkerQueue, DeliversEverythingInOrder) {
  std::vector<int> taken;
  {
    DroppingWorkerQueue<int> queue(1000, [&taken](int&& value) { taken.push_back(value); });
    for (int i = 0; i < 1000; ++i) EXPECT_TRUE(queue.give(int{i}));
    EXPECT_EQ(0u, queue.dropped());
  }  // what waits is delivered before the object goes
  ASSERT_EQ(1000u, taken.size());
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(i, taken[static_cast<std::size_t>(i)]);
}

TEST(DroppingWorkerQueue, NeverMakesTheGiverWait) {
  std::promise<void> stalled, go_on;
  std::vector<int> taken;
  {
    DroppingWorkerQueue<int> queue(8, [&](int&& value) {
      if (taken.empty()) {
        stalled.set_value();
        go_on.get_future().wait();
      }
      taken.push_back(value);
    });
    queue.give(0);
    stalled.get_future().wait();
    int dropped = 0;
    for (int i = 1; i <= 20; ++i) dropped += queue.give(int{i}) ? 0 : 1;  // the taker stalls: waiting would not end
    EXPECT_EQ(12, dropped);
    EXPECT_EQ(12u, queue.dropped());
    go_on.set_value();
  }
  EXPECT_EQ((std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8}), taken);
}

TEST(DroppingWorkerQueue, WakesTheTakerEveryTime) {
  std::atomic<int> sum{0};
  DroppingWorkerQueue<int> queue(4, [&sum](int&& value) { sum += value; });
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(queue.give(1));
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (sum != i + 1 && std::chrono::steady_clock::now() < until) std::this_thread::yield();
    ASSERT_EQ(i + 1, sum);
  }
}

}  // namespace
}  // namespace mmradartwin
