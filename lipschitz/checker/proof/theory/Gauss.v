(** The error function tends to 1, and how fast. With I the integral of exp (- t^2) from 0, the square of I (x) and the
  Riemann sums of exp (- x^2 (1 + t^2)) / (1 + t^2) over t in [0, 1] have nearly opposite derivatives. *)
From Coq Require Import Reals Lra Lia.
From Swarmcert Require Import Exponential Activations ErrorFunction.
Open Scope R_scope.

Lemma bell_falls x y : 0 <= x <= y -> bell y <= bell x.
Proof. intros H. apply exp_rises. nra. Qed.
Lemma bell_positive x : 0 < bell x. Proof. apply exp_pos. Qed.
Lemma bell_at_0 : bell 0 = 1. Proof. unfold bell. rewrite Rmult_0_l, Ropp_0. apply exp_0. Qed.
Lemma integral_at_0 : integral 0 = 0. Proof. unfold integral. ring. Qed.

(** tan, up to PI / 4. *)
Lemma tan_derivative x : 0 < cos x -> derivable_pt_lim tan x (1 + tan x * tan x).
Proof.
  intros C. replace (1 + tan x * tan x) with ((cos x * cos x - - sin x * sin x) / Rsqr (cos x))
    by (unfold tan, Rsqr; field; lra).
  apply (derivable_pt_lim_div sin cos x); [apply derivable_pt_lim_sin|apply derivable_pt_lim_cos|lra].
Qed.
Lemma cos_positive x : 0 <= x <= PI / 4 -> 0 < cos x.
Proof. intros H. pose proof pi_large. apply cos_gt_0; lra. Qed.
Lemma tan_rises x y : 0 <= x -> x <= y -> y <= PI / 4 -> tan x <= tan y.
Proof.
  intros A L B. enough (0 * (y - x) <= tan y - tan x) by lra.
  apply (at_least_the_derivative tan (fun c => 1 + tan c * tan c)); auto. intros c Hc.
  split; [apply tan_derivative, cos_positive; lra|]. pose proof (Rle_0_sqr (tan c)). unfold Rsqr in *. lra.
Qed.

Section Sums.
Context (n : nat) (Hn : (0 < n)%nat).
Definition step : R := PI / 4 / INR n.
Definition place (k : nat) : R := tan (INR k * step).
Definition width (k : nat) : R := place (S k) - place k.
Lemma step_positive : 0 < step.
Proof. pose proof pi_large. pose proof (lt_0_INR n Hn). unfold step. apply Rdiv_lt_0_compat; lra. Qed.
Lemma angle_between k : (k <= n)%nat -> 0 <= INR k * step <= PI / 4.
Proof.
  intros K. apply le_INR in K. pose proof (pos_INR k). pose proof step_positive. pose proof (lt_0_INR n Hn).
  split; [nra|]. replace (PI / 4) with (INR n * step) by (unfold step; field; lra). nra.
Qed.
Lemma place_first : place 0 = 0. Proof. unfold place. simpl. rewrite Rmult_0_l. apply tan_0. Qed.
Lemma place_last : place n = 1.
Proof.
  unfold place, step. pose proof (lt_0_INR n Hn). replace (INR n * (PI / 4 / INR n)) with (PI / 4) by (field; lra).
  apply tan_PI4.
Qed.
Lemma place_between k : (k <= n)%nat -> 0 <= place k <= 1.
Proof.
  intros K. pose proof (angle_between k K) as A. rewrite <- place_first at 1. rewrite <- place_last. unfold place.
  split; apply tan_rises; simpl; try lra; try apply angle_between; try lia.
  pose proof step_positive. apply Rmult_le_compat_r; [lra|]. now apply le_INR.
Qed.
Lemma width_between k : (k < n)%nat ->
  step * (1 + place k * place k) <= width k <= step * (1 + place (S k) * place (S k)).
Proof.
  intros K. pose proof (angle_between k ltac:(lia)) as A. pose proof (angle_between (S k) ltac:(lia)) as B.
  pose proof step_positive as P. assert (INR (S k) * step = INR k * step + step) as E by (rewrite S_INR; ring).
  assert (step = INR (S k) * step - INR k * step) as D by lra. unfold width.
  assert (forall c, INR k * step <= c <= INR (S k) * step ->
    1 + place k * place k <= 1 + tan c * tan c <= 1 + place (S k) * place (S k)) as T.
  { intros c Hc. pose proof (place_between k ltac:(lia)). unfold place in *.
    pose proof (tan_rises (INR k * step) c ltac:(lra) ltac:(lra) ltac:(lra)).
    pose proof (tan_rises c (INR (S k) * step) ltac:(lra) ltac:(lra) ltac:(lra)).
    split; apply Rplus_le_compat_l, Rmult_le_compat; lra. }
  assert (forall c, INR k * step <= c <= INR (S k) * step -> derivable_pt_lim tan c (1 + tan c * tan c)) as Dt
    by (intros c Hc; apply tan_derivative, cos_positive; lra).
  rewrite D at 1 2. rewrite !(Rmult_comm (_ - _)). unfold place at 2 3.
  split; [apply (at_least_the_derivative tan (fun c => 1 + tan c * tan c))|
    apply (at_most_the_derivative tan (fun c => 1 + tan c * tan c))]; try lra; intros c Hc;
    (split; [apply Dt; lra|apply T; lra]).
Qed.
Lemma width_small k : (k < n)%nat -> 0 <= width k <= 2 * step.
Proof.
  intros K. pose proof (width_between k K) as W. pose proof (place_between k ltac:(lia)).
  pose proof (place_between (S k) ltac:(lia)). pose proof step_positive.
  assert (0 <= place k * place k) by (apply Rmult_le_pos; lra).
  assert (place (S k) * place (S k) <= 1 * 1) by (apply Rmult_le_compat; lra). split; nra.
Qed.

(** The sum, and what its derivative is, times - 2 x bell x. *)
Fixpoint outer_sum (m : nat) (x : R) : R :=
  match m with
  | O => 0
  | S k => outer_sum k x + width k * (/ (1 + place k * place k) * exp (- (x * x * (1 + place k * place k))))
  end.
Fixpoint inner_sum (m : nat) (x : R) : R :=
  match m with O => 0 | S k => inner_sum k x + width k * bell (x * place k) end.
Lemma outer_derivative m x : derivable_pt_lim (outer_sum m) x (- (2 * x * bell x * inner_sum m x)).
Proof.
  induction m as [|k IH]; cbn [outer_sum inner_sum].
  - rewrite Rmult_0_r, Ropp_0. apply derivable_pt_lim_const.
  - set (q := 1 + place k * place k). assert (0 < q) by (unfold q; pose proof (Rle_0_sqr (place k)); unfold Rsqr in *;
      lra).
    replace (- (2 * x * bell x * (inner_sum k x + width k * bell (x * place k)))) with
      (- (2 * x * bell x * inner_sum k x) + width k * (/ q * (exp (- (x * x * q)) * - ((1 * x + x * 1) * q)))).
    + apply (derivable_pt_lim_plus (outer_sum k) (fun x => width k * (/ q * exp (- (x * x * q))))); [exact IH|].
      apply (derivable_pt_lim_scal (fun x => / q * exp (- (x * x * q)))).
      apply (derivable_pt_lim_scal (fun x => exp (- (x * x * q)))).
      apply (derivable_pt_lim_comp (fun x => - (x * x * q)) exp); [|apply derivable_pt_lim_exp].
      apply (derivable_pt_lim_opp (fun x => x * x * q)).
      replace ((1 * x + x * 1) * q) with ((1 * x + x * 1) * q + x * x * 0) by ring.
      apply (derivable_pt_lim_mult (fun x => x * x) (fun _ => q)); [|apply derivable_pt_lim_const].
      apply (derivable_pt_lim_mult id id); apply derivable_pt_lim_id.
    + assert (exp (- (x * x * q)) = bell x * bell (x * place k)) as ->
        by (unfold bell, q; rewrite <- exp_plus; f_equal; ring). field. lra.
Qed.
Lemma inner_between m x : (m <= n)%nat -> 0 <= x ->
  integral (x * place m) <= x * inner_sum m x <= integral (x * place m) + x * (2 * step) * (1 - bell (x * place m)).
Proof.
  intros M X. induction m as [|k IH]; cbn [inner_sum].
  - rewrite place_first, !Rmult_0_r, integral_at_0, bell_at_0. lra.
  - specialize (IH ltac:(lia)). pose proof (width_small k ltac:(lia)) as W.
    pose proof (place_between k ltac:(lia)) as P.
    set (p := x * place k) in *. set (q := x * place (S k)) in *.
    assert (q - p = x * width k) as D by (unfold p, q, width; ring). assert (0 <= p <= q) as O by (unfold p in *; nra).
    assert (forall c, p <= c <= q -> bell q <= bell c <= bell p) as B
      by (intros c Hc; split; apply bell_falls; lra).
    pose proof (integral_below p q (bell p) ltac:(lra) (fun c Hc => proj2 (B c Hc))) as U.
    pose proof (integral_above p q (bell q) ltac:(lra) (fun c Hc => proj1 (B c Hc))) as V. rewrite D in U, V.
    pose proof (bell_falls p q O) as F. pose proof (Rmult_le_compat_l x _ _ X (proj2 W)).
    assert (x * width k * (bell p - bell q) <= x * (2 * step) * (bell p - bell q)) by (apply Rmult_le_compat_r; lra).
    split; lra.
Qed.
Lemma outer_at_0 m : (m <= n)%nat ->
  INR m * step <= outer_sum m 0 <= INR m * step + step * (place m * place m).
Proof.
  intros M. induction m as [|k IH]; cbn [outer_sum]; [rewrite place_first; simpl; lra|]. specialize (IH ltac:(lia)).
  pose proof (width_between k ltac:(lia)) as W. pose proof (place_between k ltac:(lia)) as P.
  pose proof (place_between (S k) ltac:(lia)) as Q. pose proof (width_small k ltac:(lia)) as S'.
  rewrite !Rmult_0_l, Ropp_0, exp_0, Rmult_1_r, S_INR. set (a := place k) in *. set (b := place (S k)) in *.
  pose proof step_positive. assert (a <= b) by (unfold width in S'; fold a b in S'; lra).
  assert (width k * / (1 + a * a) * (1 + a * a) = width k) as E by (field; nra).
  assert (0 <= width k * / (1 + a * a)) as N
    by (apply Rmult_le_pos; [lra|]; left; apply Rinv_0_lt_compat; nra).
  set (v := width k * / (1 + a * a)) in *. clearbody v. split.
  - assert (step <= v); [|lra]. apply (Rmult_le_reg_r (1 + a * a)); nra.
  - assert (v <= step * (1 + (b * b - a * a))); [|lra]. apply (Rmult_le_reg_r (1 + a * a)); [nra|]. rewrite E.
    assert (0 <= step * (a * a * (b * b - a * a))) by (apply Rmult_le_pos; [lra|]; apply Rmult_le_pos; nra). lra.
Qed.
Lemma outer_below m x : (m <= n)%nat -> 0 <= outer_sum m x <= bell x * place m.
Proof.
  intros M. induction m as [|k IH]; cbn [outer_sum]; [rewrite place_first; lra|]. specialize (IH ltac:(lia)).
  pose proof (width_small k ltac:(lia)) as W. set (q := 1 + place k * place k).
  assert (1 <= q) by (unfold q; pose proof (Rle_0_sqr (place k)); unfold Rsqr in *; lra).
  assert (0 < / q <= 1) as I
    by (split; [apply Rinv_0_lt_compat; lra|]; rewrite <- Rinv_1; apply Rinv_le_contravar; lra).
  assert (0 < exp (- (x * x * q)) <= bell x) as B.
  { split; [apply exp_pos|]. apply exp_rises. pose proof (Rle_0_sqr x). unfold Rsqr in *. nra. }
  set (e := exp _) in *. assert (0 <= / q * e <= bell x) as T by (split; nra).
  assert (place (S k) = place k + width k) as E by (unfold width; ring). rewrite E. split; nra.
Qed.

Lemma square_between x : 0 <= x -> PI / 4 - bell x - 2 * step <= integral x * integral x <= PI / 4 + step.
Proof.
  intros X. pose proof (outer_at_0 n (le_n n)) as Z. rewrite place_last, Rmult_1_r in Z.
  pose proof (outer_below n x (le_n n)) as O. rewrite place_last, Rmult_1_r in O. pose proof (lt_0_INR n Hn).
  assert (INR n * step = PI / 4) as A by (unfold step; field; lra). rewrite A in Z.
  pose proof step_positive as P. pose proof (bell_positive x) as Bx.
  set (f x := integral x * integral x + outer_sum n x).
  set (d x := bell x * integral x + integral x * bell x + - (2 * x * bell x * inner_sum n x)).
  assert (forall c, derivable_pt_lim f c (d c)) as D.
  { intros c. apply (derivable_pt_lim_plus (fun x => integral x * integral x) (outer_sum n)); [|apply outer_derivative].
    apply (derivable_pt_lim_mult integral integral); apply integral_derivative. }
  assert (forall c, 0 <= c -> 2 * step * (bell c * - (1 * c + c * 1)) <= d c <= 0) as Between.
  { intros c Hc. pose proof (inner_between n c (le_n n) Hc) as I. rewrite place_last, !Rmult_1_r in I.
    pose proof (bell_positive c) as Bc. unfold d. set (s := c * inner_sum n c) in *.
    replace (2 * c * bell c * inner_sum n c) with (2 * (bell c * s)) by (unfold s; ring).
    assert (bell c * integral c <= bell c * s) by (apply Rmult_le_compat_l; lra).
    assert (0 <= c * (2 * step) * bell c) by (apply Rmult_le_pos; [apply Rmult_le_pos|]; lra).
    assert (s - integral c <= c * (2 * step)) as J by lra.
    assert (bell c * (s - integral c) <= bell c * (c * (2 * step))) by (apply Rmult_le_compat_l; lra). split; lra. }
  assert (f 0 = outer_sum n 0) as F0 by (unfold f; rewrite integral_at_0; ring). split.
  - assert (0 * (x - 0) <= (f x - 2 * step * bell x) - (f 0 - 2 * step * bell 0)) as G.
    { apply (at_least_the_derivative (fun x => f x - 2 * step * bell x)
        (fun x => d x - 2 * step * (bell x * - (1 * x + x * 1)))); auto.
      intros c Hc. split; [|specialize (Between c ltac:(lra)); lra].
      apply (derivable_pt_lim_minus f (fun x => 2 * step * bell x)); [apply D|].
      apply (derivable_pt_lim_scal bell), bell_derivative. }
    rewrite F0, bell_at_0 in G. unfold f in G. assert (0 <= 2 * step * bell x) by nra. lra.
  - assert (f x - f 0 <= 0 * (x - 0)) as G.
    { apply (at_most_the_derivative f d); auto. intros c Hc. split; [apply D|]. apply Between. lra. }
    rewrite F0 in G. unfold f in G. lra.
Qed.
End Sums.

Lemma at_most_any_small a c : (forall n, (0 < n)%nat -> a <= c * step n) -> a <= 0.
Proof.
  intros H. destruct (Rle_lt_dec a 0) as [|A]; auto. pose proof pi_large.
  assert (0 < a / (Rabs c * PI + 1)) as E.
  { apply Rdiv_lt_0_compat; auto. pose proof (Rabs_pos c). nra. }
  destruct (archimed_cor1 _ E) as (n & N & P). specialize (H n P). pose proof (lt_0_INR n P) as I.
  assert (0 < / INR n) as J by now apply Rinv_0_lt_compat. pose proof (Rabs_pos c). pose proof (Rle_abs c).
  assert (c * step n <= Rabs c * PI * / INR n) as B.
  { unfold step, Rdiv. assert (0 <= PI * / INR n) by nra. nra. }
  assert (/ INR n * (Rabs c * PI + 1) < a) as K.
  { apply (Rmult_lt_compat_r (Rabs c * PI + 1)) in N; [|nra]. unfold Rdiv in N.
    rewrite Rmult_assoc, Rinv_l, Rmult_1_r in N by nra. exact N. }
  nra.
Qed.
(** The limit is sqrt PI / 2. *)
Theorem integral_square x : 0 <= x -> PI / 4 - bell x <= integral x * integral x <= PI / 4.
Proof.
  intros X. split.
  - enough (PI / 4 - bell x - integral x * integral x <= 0) by lra. apply (at_most_any_small _ 2). intros n N.
    pose proof (square_between n N x X). lra.
  - enough (integral x * integral x - PI / 4 <= 0) by lra. apply (at_most_any_small _ 1). intros n N.
    pose proof (square_between n N x X). lra.
Qed.
