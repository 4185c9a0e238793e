// SPDX-License-Identifier: Apache-2.0
// Bytes of bursts come out of the lane merge side by side, as they were sent, for all skews up to the largest, and for
// ever; and a burst that not all lanes begin in time is told, never twice.
//
// A sender has all lanes in step; each lane is late by clocks that the solver chooses anew for each burst, up to one more
// than the largest skew. Bursts have any length and any bytes, lanes end at most a clock apart, as bytes are dealt out in
// turn, and one clock of rest on each lane lies between bursts. A burst of which a lane is too late, or misses its sync, is faulty: no word comes of it. The
// syncs of the burst behind a faulty one come more than the largest skew behind all of its own, as the port asks.

module merge_properties #(
    parameter LANES = 2,
    parameter MAX_SKEW = 2,
    // Bits of each byte that are compared: bytes move whole, so that one shows all that can go wrong with their order.
    parameter BITS = 8
) (
    input clk,
    input [LANES-1:0] valid,
    input start,
    input [LANES-1:0] missing_lane,
    input [8*LANES-1:0] data,
    input [4*LANES-1:0] any_skew
);
  localparam LATE = MAX_SKEW + 1;
  // Clocks that the sender remembers.
  localparam DEPTH = LATE + 2;

  reg begun = 0;
  // The burst under way: its lanes' skews, their largest and whether it is faulty.
  reg [LANES-1:0] active = 0;
  reg [4*LANES-1:0] skew_held = 0;
  reg [3:0] latest_held = 0;
  reg faulty_held = 0;
  // Clocks since each lane's last byte, and since the last burst began; the latest sync of that burst.
  reg [4*LANES-1:0] idle = {LANES{4'd15}};
  reg [4:0] since = 31;
  reg [3:0] last_sync = 0;

  // The burst that may begin: its skews, its first and its last sync.
  integer i, k;
  reg [4*LANES-1:0] skew_new;
  reg [3:0] earliest, latest, sync_latest;
  reg all_missing, in_order;
  always @* begin
    earliest = 15;
    latest = 0;
    sync_latest = 0;
    in_order = 1;
    for (i = 0; i < LANES; i = i + 1) begin
      skew_new[4*i+:4] = any_skew[4*i+:4] > LATE ? 0 : any_skew[4*i+:4];
      if (skew_new[4*i+:4] > latest) latest = skew_new[4*i+:4];
      if (!missing_lane[i]) begin
        if (skew_new[4*i+:4] < earliest) earliest = skew_new[4*i+:4];
        if (skew_new[4*i+:4] > sync_latest) sync_latest = skew_new[4*i+:4];
      end
      // A clock of rest between the last byte of the burst before and the first one of this.
      if (skew_new[4*i+:4] + idle[4*i+:4] < skew_held[4*i+:4] + 2) in_order = 0;
    end
  end
  wire far = since + earliest > last_sync + MAX_SKEW;
  wire starts = begun && start && active == 0 && missing_lane != {LANES{1'b1}} && in_order && (!faulty_held || far);
  wire faulty_new = missing_lane != 0 || latest > earliest + MAX_SKEW;
  wire [LANES-1:0] sent = starts ? {LANES{1'b1}} : begun && active == {LANES{1'b1}} ? valid : 0;
  wire [LANES-1:0] syncs = starts ? ~missing_lane : 0;
  wire [4*LANES-1:0] skew = starts ? skew_new : skew_held;
  wire [3:0] latest_now = starts ? latest : latest_held;
  wire faulty = starts ? faulty_new : faulty_held;

  // What was sent, clock by clock, the last one first.
  reg [LANES-1:0] sent_at[0:DEPTH];
  reg [LANES-1:0] sync_at[0:DEPTH];
  reg [8*LANES-1:0] data_at[0:DEPTH];
  reg [4*LANES-1:0] skew_at[0:DEPTH];
  reg [3:0] latest_at[0:DEPTH];
  reg [DEPTH:0] start_at = 0;
  reg [DEPTH:0] good_at = 0;

  initial
    for (i = 0; i <= DEPTH; i = i + 1) begin
      sent_at[i] = 0;
      sync_at[i] = 0;
      data_at[i] = 0;
      skew_at[i] = 0;
      latest_at[i] = 0;
    end

  // The lanes: each has what was sent as many clocks ago as it is late.
  reg [LANES-1:0] lane_valid, lane_sync;
  reg [8*LANES-1:0] lane_data;
  always @* begin
    for (i = 0; i < LANES; i = i + 1) begin
      lane_valid[i] = sent[i] && skew[4*i+:4] == 0;
      lane_sync[i] = syncs[i] && skew[4*i+:4] == 0;
      lane_data[8*i+:8] = data[8*i+:8];
      for (k = 0; k < LATE; k = k + 1)
        if (sent_at[k][i] && skew_at[k][4*i+:4] == k + 1) begin
          lane_valid[i] = 1;
          lane_sync[i] = sync_at[k][i];
          lane_data[8*i+:8] = data_at[k][8*i+:8];
        end
    end
  end

  always @(posedge clk) begin
    begun <= 1;
    active <= sent;
    skew_held <= skew;
    latest_held <= latest_now;
    faulty_held <= faulty;
    since <= starts ? 1 : since == 31 ? 31 : since + 1;
    if (starts) last_sync <= sync_latest;
    for (i = 0; i < LANES; i = i + 1) idle[4*i+:4] <= sent[i] ? 1 : idle[4*i+:4] == 15 ? 15 : idle[4*i+:4] + 1;
    sent_at[0] <= sent;
    sync_at[0] <= syncs & sent;
    data_at[0] <= data;
    skew_at[0] <= skew;
    latest_at[0] <= latest_now;
    start_at <= {start_at, starts};
    good_at <= {good_at, !faulty};
    for (i = 0; i < DEPTH; i = i + 1) begin
      sent_at[i+1] <= sent_at[i];
      sync_at[i+1] <= sync_at[i];
      data_at[i+1] <= data_at[i];
      skew_at[i+1] <= skew_at[i];
      latest_at[i+1] <= latest_at[i];
    end
  end

  wire word_first, lane_missing;
  wire [LANES-1:0] word_live;
  wire [8*LANES-1:0] word_data;

  lane_merge dut (
      .clk(clk),
      .lane_valid(lane_valid),
      .lane_sync(lane_sync),
      .lane_data(lane_data),
      .lane_missed({LANES{1'b0}}),
      .word_first(word_first),
      .word_live(word_live),
      .word_data(word_data),
      .lane_missing(lane_missing)
  );

  // Faulty bursts that may still be told, and one that must be: of faulty ones right behind each other, some may count
  // as the one before.
  reg [2:0] may_tell = 0;
  reg must_tell = 0;
  reg [4:0] wait_told = 0;
  wire fails = starts && faulty_new;
  always @(posedge clk) begin
    if (wait_told == 0) may_tell <= fails;
    else if (fails && !lane_missing) may_tell <= may_tell == 7 ? 7 : may_tell + 1;
    else if (lane_missing && !fails) may_tell <= may_tell - 1;
    if (fails && !faulty_held) must_tell <= 1;
    else if (lane_missing) must_tell <= 0;
    wait_told <= fails ? 2 * MAX_SKEW + 4 : wait_told != 0 ? wait_told - 1 : 0;
  end

  // The word that is due: it was sent two clocks and the burst's largest skew ago.
  reg first_due;
  reg [LANES-1:0] live_due;
  reg [8*LANES-1:0] data_due;
  always @* begin
    first_due = 0;
    live_due = 0;
    data_due = 0;
    for (k = 1; k <= DEPTH; k = k + 1)
      if (latest_at[k] + 1 == k && good_at[k] && sent_at[k] != 0) begin
        first_due = start_at[k];
        live_due = sent_at[k];
        data_due = data_at[k];
      end
  end

  always @* begin
    if (begun) begin
      assert (word_first == first_due);
      // Without the first lane's byte there is no word.
      assert (word_live[0] == live_due[0]);
      if (live_due[0]) assert (word_live == live_due);
      for (i = 0; i < LANES; i = i + 1)
        if (word_live[0] && word_live[i]) assert (word_data[8*i+:BITS] == data_due[8*i+:BITS]);
      assert (!lane_missing || may_tell != 0);
      assert (!must_tell || wait_told != 0);
    end
  end
endmodule
