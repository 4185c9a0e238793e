// SPDX-License-Identifier: Apache-2.0
// Bytes of bursts come out of the lane merge side by side, as they were sent, for all skews up to the largest, and for
// ever; and a lane that misses its sync is told.
//
// One sender has all lanes in step; each lane is late by clocks that the solver chooses for good. Bursts have any length
// and any bytes, and lanes end where they like. Between two syncs are more clocks than the largest skew. A burst may
// miss the sync of one lane: then no word comes of it, and it is told.

module merge_properties #(
    parameter LANES = 2,
    parameter MAX_SKEW = 2
) (
    input clk,
    input [LANES-1:0] valid,
    input start,
    input miss,
    input [LANES-1:0] missing_lane,
    input [8*LANES-1:0] data,
    input [3*LANES-1:0] any_skew
);
  // Skews, chosen in the first clock.
  reg begun = 0;
  reg [3*LANES-1:0] skew = 0;
  // Clocks since the last sync; a burst is under way.
  reg [4:0] since = 31;
  reg active = 0;

  wire starts = begun && start && since > 2 * MAX_SKEW + 2;
  wire [LANES-1:0] sent = (starts ? {LANES{1'b1}} : 0) | (begun && (starts || active) ? valid : 0);
  wire misses = starts && miss && missing_lane != 0 && missing_lane != {LANES{1'b1}};
  wire [LANES-1:0] syncs = starts ? (misses ? ~missing_lane : {LANES{1'b1}}) : 0;

  // What was sent, clock by clock, and the lane ports as each lane's skew has them.
  localparam DEPTH = MAX_SKEW + 3;
  reg [LANES-1:0] sent_at[0:DEPTH];
  reg [LANES-1:0] sync_at[0:DEPTH];
  reg [8*LANES-1:0] data_at[0:DEPTH];
  reg [DEPTH:0] start_at = 0;
  reg [DEPTH:0] miss_at = 0;
  wire [LANES-1:0] lane_valid, lane_sync;
  wire [8*LANES-1:0] lane_data;

  genvar g;
  generate
    for (g = 0; g < LANES; g = g + 1) begin : late
      wire [2:0] by = skew[3*g+:3];
      assign lane_valid[g] = by == 0 ? sent[g] : sent_at[by-1][g];
      assign lane_sync[g] = by == 0 ? syncs[g] : sync_at[by-1][g];
      assign lane_data[8*g+:8] = by == 0 ? data[8*g+:8] : data_at[by-1][8*g+:8];
    end
  endgenerate

  integer i;
  reg [2:0] latest;
  always @* begin
    latest = 0;
    for (i = 0; i < LANES; i = i + 1) if (skew[3*i+:3] > latest) latest = skew[3*i+:3];
  end

  initial for (i = 0; i <= DEPTH; i = i + 1) begin
    sent_at[i] = 0;
    sync_at[i] = 0;
    data_at[i] = 0;
  end

  always @(posedge clk) begin
    begun <= 1;
    if (!begun) begin
      for (i = 0; i < LANES; i = i + 1) skew[3*i+:3] <= any_skew[3*i+:3] > MAX_SKEW ? 0 : any_skew[3*i+:3];
    end
    since <= starts ? 0 : since == 31 ? 31 : since + 1;
    active <= (starts || active) && sent[0];
    sent_at[0] <= sent;
    sync_at[0] <= syncs;
    data_at[0] <= data;
    start_at <= {start_at, starts};
    miss_at <= {miss_at, misses};
    for (i = 0; i < DEPTH; i = i + 1) begin
      sent_at[i+1] <= sent_at[i];
      sync_at[i+1] <= sync_at[i];
      data_at[i+1] <= data_at[i];
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
      .word_first(word_first),
      .word_live(word_live),
      .word_data(word_data),
      .lane_missing(lane_missing)
  );

  // The word that is due: it was sent two clocks and the largest skew ago. A burst that missed a sync gives none.
  wire [3:0] due = latest + 1;
  reg good = 0;
  wire now_good = start_at[due] ? !miss_at[due] : good;
  always @(posedge clk) good <= now_good;

  // After a sync is missed there is a word of it in the time that all its syncs take to leave.
  reg told = 1;
  reg [4:0] wait_told = 0;
  always @(posedge clk) begin
    if (misses) begin
      told <= 0;
      wait_told <= 2 * MAX_SKEW + 3;
    end else begin
      if (lane_missing) told <= 1;
      if (wait_told != 0) wait_told <= wait_told - 1;
    end
  end

  always @* begin
    if (begun) begin
      assert (word_first == (start_at[due] && !miss_at[due]));
      if (start_at[due] && !miss_at[due]) assert (word_live == {LANES{1'b1}});
      for (i = 0; i < LANES; i = i + 1)
        if (now_good && word_live[i]) assert (sent_at[due][i] && word_data[8*i+:8] == data_at[due][8*i+:8]);
      if (now_good && sent_at[due][0]) assert (word_live == sent_at[due]);
      // A miss is told in time, and nothing else is.
      assert (told || wait_told != 0);
      assert (!lane_missing || wait_told != 0);
    end
  end
endmodule
