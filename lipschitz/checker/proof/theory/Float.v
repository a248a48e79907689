(** Sums of products in float32, in whatever order and with or without fused multiply-adds,
  and how far off they are. *)
From Coq Require Import List Reals Lra Lia Psatz Permutation.
From Swarmcert Require Import Algebra Activations Form Network.
Import ListNotations.
Open Scope R_scope.

#[local] Arguments powerRZ : simpl never.

(** Half a unit in the last place, relative, and half the smallest float. *)
Definition roundoff : R := / 16777216.
Definition tiny : R := powerRZ 2 (-150).
(** What an operation returns for the exact result, rounded to nearest.
  Beyond 2^127, near overflow, nothing is assumed. *)
Definition rounds (exact v : R) : Prop := Rabs exact <= powerRZ 2 127 ->
  Rabs (v - exact) <= roundoff * Rabs exact + tiny.
(** v is a sum of the summands as an evaluation computes it: each rounded by itself or fused into an addition. *)
Inductive float_sum : list R -> R -> Prop :=
| summand s v : rounds s v -> float_sum [s] v
| fused s l a v : float_sum l a -> rounds (s + a) v -> float_sum (s :: l) v
| added l k a b v : float_sum l a -> float_sum k b -> rounds (a + b) v -> float_sum (l ++ k) v
| reordered l k v : Permutation l k -> float_sum l v -> float_sum k v.
(** The same, with half the distance between floats below a power of two. *)
Definition rounds_closely (exact v : R) : Prop := rounds exact v /\
  forall k, (k <= 127)%Z -> Rabs exact <= powerRZ 2 k -> Rabs (v - exact) <= powerRZ 2 (k - 25) + tiny.
(** v is what becomes of a where the summands are added to it one after the other, each rounded by itself or fused. *)
Inductive added_in_order : R -> list R -> R -> Prop :=
| none_left a : added_in_order a [] a
| rounded_next a s l p b v : rounds_closely s p -> rounds_closely (a + p) b -> added_in_order b l v ->
    added_in_order a (s :: l) v
| fused_next a s l b v : rounds_closely (s + a) b -> added_in_order b l v -> added_in_order a (s :: l) v.
(** `in_order`: each sum starts with the bias, and the products follow from the first input to the last. *)
Definition float_layer (in_order : bool) (l : matrix * list R) (h v : list R) : Prop :=
  Forall2 (fun row_bias y => let products := timesR (fst row_bias) h in
    if in_order then added_in_order (snd row_bias) products y else float_sum (snd row_bias :: products) y)
    (combine (fst l) (snd l)) v.
Fixpoint float_network (in_order : bool) (hidden : list (matrix * list R)) (last : matrix * list R) (h v : list R)
    : Prop :=
  match hidden with
  | [] => float_layer in_order last h v
  | l :: hidden' => exists y, float_layer in_order l h y /\ float_network in_order hidden' last (map relu y) v
  end.

Definition total (l : list R) : R := fold_right Rplus 0 l.
Definition total_abs (l : list R) : R := fold_right (fun a s => Rabs a + s) 0 l.
Lemma total_app l k : total (l ++ k) = total l + total k.
Proof. induction l; simpl; lra. Qed.
Lemma total_abs_app l k : total_abs (l ++ k) = total_abs l + total_abs k.
Proof. induction l; simpl; lra. Qed.
Lemma total_abs_nonneg l : 0 <= total_abs l.
Proof. induction l as [|a l IH]; simpl; [lra|]. pose proof (Rabs_pos a). lra. Qed.
Lemma total_below l : Rabs (total l) <= total_abs l.
Proof. induction l as [|a l IH]; simpl; [rewrite Rabs_R0; lra|]. pose proof (Rabs_triang a (total l)). lra. Qed.
Lemma total_permuted l k : Permutation l k -> total l = total k /\ total_abs l = total_abs k /\ length l = length k.
Proof. intros H. induction H; simpl; lra || (repeat split; try lra; try lia) || idtac. Qed.

Lemma roundoff_pos : 0 < roundoff. Proof. unfold roundoff. lra. Qed.
Lemma tiny_pos : 0 < tiny. Proof. apply powerRZ_lt. lra. Qed.
Definition growth (n : nat) : R := (1 + roundoff) ^ n.
Lemma growth_one n : 1 <= growth n.
Proof. apply pow_R1_Rle. pose proof roundoff_pos. lra. Qed.
Lemma growth_le n m : (n <= m)%nat -> growth n <= growth m.
Proof. apply Rle_pow. pose proof roundoff_pos. lra. Qed.
Definition count (l : list R) : R := INR (length l).
(** Bounds on the error and on the computed value, of n summands with the absolute values' sum m. *)
Definition error_of (n : nat) (m : R) : R := (growth n - 1) * m + (2 * INR n - 1) * tiny * growth n.
Definition value_at_most (n : nat) (m : R) : R := growth n * (m + (2 * INR n - 1) * tiny).

Lemma fused_error u t g m s S a v k : 0 < u -> 0 < t -> 1 <= g -> 1 <= k -> 0 <= m -> Rabs S <= m ->
  Rabs (a - S) <= (g - 1) * m + (2 * k - 1) * t * g -> Rabs (v - (s + a)) <= u * Rabs (s + a) + t ->
  Rabs (v - (s + S)) <= ((1 + u) * g - 1) * (Rabs s + m) + (2 * (k + 1) - 1) * t * ((1 + u) * g).
Proof.
  intros Hu Ht Hg Hk Hm HS Ha Hv. pose proof (Rabs_pos s).
  assert (Rabs (v - (s + S)) <= Rabs (v - (s + a)) + Rabs (a - S)) as T
    by (replace (v - (s + S)) with ((v - (s + a)) + (a - S)) by ring; apply Rabs_triang).
  assert (Rabs (s + a) <= Rabs s + (Rabs (a - S) + Rabs S)) as A.
  { eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat_l.
    replace a with ((a - S) + S) at 1 by ring. apply Rabs_triang. }
  set (e := Rabs (a - S)) in *. set (x := Rabs (v - (s + S))) in *. set (y := Rabs (v - (s + a))) in *.
  assert (u * Rabs (s + a) <= u * (Rabs s + (e + Rabs S))) by (apply Rmult_le_compat_l; lra).
  assert (u * (e + Rabs S) <= u * ((g - 1) * m + (2 * k - 1) * t * g + m)) by (apply Rmult_le_compat_l; lra).
  assert (0 <= (g - 1) * (1 + u) * Rabs s) by (apply Rmult_le_pos; [apply Rmult_le_pos; lra|lra]).
  assert (0 <= t * (2 * ((1 + u) * g) - 1)) by (apply Rmult_le_pos; nra). nra.
Qed.
Lemma added_error u t g h f m n S T a b v j k : 0 < u -> 0 < t -> 1 <= g -> 1 <= h -> 1 <= j -> 1 <= k ->
  (1 + u) * g <= f -> (1 + u) * h <= f -> 0 <= m -> 0 <= n -> Rabs S <= m -> Rabs T <= n ->
  Rabs (a - S) <= (g - 1) * m + (2 * j - 1) * t * g -> Rabs (b - T) <= (h - 1) * n + (2 * k - 1) * t * h ->
  Rabs (v - (a + b)) <= u * Rabs (a + b) + t ->
  Rabs (v - (S + T)) <= (f - 1) * (m + n) + (2 * (j + k) - 1) * t * f.
Proof.
  intros Hu Ht Hg Hh Hj Hk Hf1 Hf2 Hm Hn HS HT Ha Hb Hv.
  assert (Rabs (v - (S + T)) <= Rabs (v - (a + b)) + (Rabs (a - S) + Rabs (b - T))) as X.
  { replace (v - (S + T)) with ((v - (a + b)) + ((a - S) + (b - T))) by ring.
    eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat_l, Rabs_triang. }
  assert (Rabs (a + b) <= (Rabs (a - S) + m) + (Rabs (b - T) + n)) as Y.
  { replace (a + b) with (((a - S) + S) + ((b - T) + T)) by ring. eapply Rle_trans; [apply Rabs_triang|].
    apply Rplus_le_compat; (eapply Rle_trans; [apply Rabs_triang|]; lra). }
  set (p := Rabs (a - S)) in *. set (q := Rabs (b - T)) in *. set (x := Rabs (v - (S + T))) in *.
  assert (x <= (1 + u) * p + (1 + u) * q + u * m + u * n + t) by nra.
  assert ((1 + u) * p <= (1 + u) * ((g - 1) * m + (2 * j - 1) * t * g)) by (apply Rmult_le_compat_l; lra).
  assert ((1 + u) * q <= (1 + u) * ((h - 1) * n + (2 * k - 1) * t * h)) by (apply Rmult_le_compat_l; lra).
  assert ((1 + u) * g * m <= f * m) by (apply Rmult_le_compat_r; lra).
  assert ((1 + u) * h * n <= f * n) by (apply Rmult_le_compat_r; lra).
  assert ((2 * j - 1) * t * ((1 + u) * g) <= (2 * j - 1) * t * f)
    by (apply Rmult_le_compat_l; [apply Rmult_le_pos; lra|lra]).
  assert ((2 * k - 1) * t * ((1 + u) * h) <= (2 * k - 1) * t * f)
    by (apply Rmult_le_compat_l; [apply Rmult_le_pos; lra|lra]).
  assert (1 <= f) by nra. assert (t * 1 <= t * f) by (apply Rmult_le_compat_l; lra). nra.
Qed.

Lemma error_nonneg n m : (1 <= n)%nat -> 0 <= m -> 0 <= error_of n m.
Proof.
  intros Hn Hm. pose proof (growth_one n). pose proof tiny_pos. pose proof (le_INR _ _ Hn) as I. simpl in I.
  unfold error_of. apply Rplus_le_le_0_compat; [apply Rmult_le_pos; lra|].
  apply Rmult_le_pos; [apply Rmult_le_pos|]; lra.
Qed.
Lemma value_error v S n m : Rabs S <= m -> Rabs (v - S) <= error_of n m -> Rabs v <= value_at_most n m.
Proof.
  intros HS H. assert (Rabs v <= Rabs (v - S) + Rabs S) as T by (replace v with ((v - S) + S) at 1 by ring;
    apply Rabs_triang).
  unfold error_of, value_at_most in *. lra.
Qed.
Lemma value_monotone n m n' m' : (1 <= n)%nat -> (n <= n')%nat -> 0 <= m -> m <= m' ->
  value_at_most n m <= value_at_most n' m'.
Proof.
  intros H1 Hn Hm Hm'. pose proof (growth_le _ _ Hn). pose proof (growth_one n). pose proof tiny_pos.
  pose proof (le_INR _ _ Hn). pose proof (le_INR _ _ H1) as I. simpl in I. unfold value_at_most.
  apply Rmult_le_compat; try lra.
  - apply Rplus_le_le_0_compat; [lra|]. apply Rmult_le_pos; lra.
  - apply Rplus_le_compat; [lra|]. apply Rmult_le_compat_r; lra.
Qed.
Theorem float_sum_error l v : float_sum l v -> (1 <= length l)%nat /\
  (value_at_most (length l) (total_abs l) <= powerRZ 2 127 ->
    Rabs (v - total l) <= error_of (length l) (total_abs l)).
Proof.
  pose proof roundoff_pos as Pu. pose proof tiny_pos as Pt.
  intros H. induction H as [s v Hv|s l a v Hl [Nl IH] Hv|l k a b v Hl [Nl IHl] Hk [Nk IHk] Hv|l k v P Hl [N IH]].
  - simpl. split; [lia|]. intros B. unfold value_at_most, error_of, growth in *. simpl in *. rewrite !Rmult_1_r in *.
    pose proof (Rabs_pos s). unfold rounds in Hv. rewrite Rplus_0_r in *.
    assert (0 <= roundoff * Rabs s) by (apply Rmult_le_pos;
      lra). assert (0 <= roundoff * tiny) by (apply Rmult_le_pos; lra).
    assert (Rabs s <= powerRZ 2 127) as L by lra. specialize (Hv L). lra.
  - simpl. split; [lia|]. intros B. pose proof (total_abs_nonneg l) as P. pose proof (Rabs_pos s) as Ps.
    pose proof (growth_one (length l)) as G. pose proof (le_INR _ _ Nl) as I. simpl in I.
    assert (value_at_most (length l) (total_abs l) <= powerRZ 2 127) as B'.
    { eapply Rle_trans; [|exact B]. apply value_monotone; simpl; auto; first [lia | lra]. }
    specialize (IH B'). pose proof (value_error _ _ _ _ (total_below l) IH) as V.
    assert (Rabs (s + a) <= powerRZ 2 127) as L.
    { eapply Rle_trans; [|exact B]. eapply Rle_trans; [apply Rabs_triang|].
      unfold value_at_most in *. unfold growth in *. cbn [pow] in *. set (g := (1 + roundoff) ^ length l) in *.
      rewrite S_INR. assert (g * (total_abs l + (2 * INR (length l) - 1) * tiny) <=
        (1 + roundoff) * g * (total_abs l + (2 * (INR (length l) + 1) - 1) * tiny)).
      { apply Rmult_le_compat; try nra. }
      assert (1 * Rabs s <= (1 + roundoff) * g * Rabs s) by (apply Rmult_le_compat_r; nra). nra. }
    specialize (Hv L). unfold error_of, growth in *. cbn [pow]. rewrite S_INR.
    apply fused_error with (a := a); auto. apply total_below.
  - rewrite app_length, total_app, total_abs_app. split; [lia|]. intros B.
    pose proof (total_abs_nonneg l) as Pl. pose proof (total_abs_nonneg k) as Pk.
    pose proof (growth_one (length l)) as Gl. pose proof (growth_one (length k)) as Gk.
    pose proof (le_INR _ _ Nl) as Il. pose proof (le_INR _ _ Nk) as Ik. simpl in Il, Ik.
    assert (value_at_most (length l) (total_abs l) <= powerRZ 2 127) as Bl
      by (eapply Rle_trans; [|exact B]; apply value_monotone; auto; first [lia | lra]).
    assert (value_at_most (length k) (total_abs k) <= powerRZ 2 127) as Bk
      by (eapply Rle_trans; [|exact B]; apply value_monotone; auto; first [lia | lra]).
    specialize (IHl Bl). specialize (IHk Bk).
    pose proof (value_error _ _ _ _ (total_below l) IHl) as Vl.
      pose proof (value_error _ _ _ _ (total_below k) IHk) as Vk.
    assert (forall n, (S n <= length l + length k)%nat ->
      (1 + roundoff) * growth n <= growth (length l + length k)) as F
      by (intros n Hn; apply (growth_le (S n)); auto).
    assert (Rabs (a + b) <= powerRZ 2 127) as L.
    { eapply Rle_trans; [|exact B]. eapply Rle_trans; [apply Rabs_triang|].
      pose proof (F (length l) ltac:(lia)). pose proof (F (length k) ltac:(lia)).
      unfold value_at_most in *. rewrite plus_INR. set (f := growth (length l + length k)) in *.
      assert (growth (length l) * (total_abs l + (2 * INR (length l) - 1) * tiny) <= f * (total_abs l + (2 * INR
        (length l) - 1) * tiny))
        by (apply Rmult_le_compat_r; nra).
      assert (growth (length k) * (total_abs k + (2 * INR (length k) - 1) * tiny) <= f * (total_abs k + (2 * INR
        (length k) - 1) * tiny))
        by (apply Rmult_le_compat_r; nra).
      assert (0 <= f * tiny) by (apply Rmult_le_pos; nra). nra. }
    specialize (Hv L). unfold error_of in *. rewrite plus_INR.
    apply added_error with (u := roundoff) (g := growth (length l)) (h := growth (length k)) (a := a) (b := b);
      auto using total_below.
    + apply F. lia.
    + apply F. lia.
  - destruct (total_permuted _ _ P) as (E1 & E2 & E3). rewrite <- E1, <- E2, <- E3. auto.
Qed.

(** (1 + u)^n <= 1 + n u + (n u)^2 while n u <= 1. *)
Lemma growth_below n : INR n * roundoff <= 1 ->
  growth n <= 1 + INR n * roundoff + (INR n * roundoff) * (INR n * roundoff).
Proof.
  pose proof roundoff_pos as P. induction n as [|n IH]; [unfold growth; simpl; lra|]. rewrite S_INR. intros H.
  assert (INR n * roundoff <= 1) as L by lra. specialize (IH L). unfold growth in *. cbn [pow].
  pose proof (pos_INR n) as Hn. set (x := INR n) in *. set (u := roundoff) in *.
  assert ((1 + u) * (1 + u) ^ n <= (1 + u) * (1 + x * u + (x * u) * (x * u))) by (apply Rmult_le_compat_l; lra).
  assert (0 <= x * u) by nra. assert ((x * u) * (x * u) <= x * u) by nra.
  assert (u * ((x * u) * (x * u)) <= u * (x * u)) by (apply Rmult_le_compat_l; lra). nra.
Qed.
Theorem float_error l v n m : float_sum l v -> INR (length l) <= n -> n <= 8388608 -> total_abs l <= m ->
  m + n * powerRZ 2 (-149) <= powerRZ 2 126 ->
  Rabs (v - total l) <= (n * roundoff + (n * roundoff) * (n * roundoff)) * m + n * powerRZ 2 (-148).
Proof.
  intros H Hn N Hm B. destruct (float_sum_error l v H) as [L E]. pose proof tiny_pos as Pt.
    pose proof roundoff_pos as Pu.
  assert (powerRZ 2 (-149) = 2 * tiny) as E1 by (unfold tiny; change (-149)%Z with (1 + -150)%Z;
    rewrite powerRZ_add by lra; rewrite powerRZ_1; ring).
  assert (powerRZ 2 (-148) = 4 * tiny) as E2 by (unfold tiny; change (-148)%Z with (2 + -150)%Z;
    rewrite powerRZ_add by lra; change (powerRZ 2 2) with (2 * (2 * 1)); ring).
  assert (powerRZ 2 127 = 2 * powerRZ 2 126) as E3 by (change 127%Z with (1 + 126)%Z; rewrite powerRZ_add by lra;
    rewrite powerRZ_1; ring).
  rewrite E1 in B. rewrite E2. set (k := INR (length l)) in *. assert (1 <= k) as K by (apply (le_INR 1); auto).
  assert (n * roundoff <= / 2) as U by (unfold roundoff; lra).
  assert (k * roundoff <= n * roundoff) as KU by (apply Rmult_le_compat_r; lra).
  pose proof (growth_below (length l) ltac:(fold k; lra)) as G. fold k in G. pose proof (growth_one (length l)) as G1.
  set (g := growth (length l)) in *. assert (0 <= k * roundoff) as KP by (apply Rmult_le_pos; lra).
  assert ((k * roundoff) * (k * roundoff) <= (n * roundoff) * (n * roundoff)) as KK by (apply Rmult_le_compat; lra).
  assert ((n * roundoff) * (n * roundoff) <= / 4) as NN by nra. assert (g <= 2) as G2 by lra.
  pose proof (total_abs_nonneg l) as P.
  assert ((2 * k - 1) * tiny <= n * (2 * tiny)) as T by nra.
  assert (Rabs (v - total l) <= error_of (length l) (total_abs l)) as F.
  { apply E. rewrite E3. unfold value_at_most. fold k g. apply Rmult_le_compat; try lra.
    apply Rplus_le_le_0_compat; [lra|]. apply Rmult_le_pos; lra. }
  eapply Rle_trans; [exact F|]. unfold error_of. fold k g. apply Rplus_le_compat.
  - apply Rmult_le_compat; lra.
  - assert ((2 * k - 1) * tiny * g <= n * (2 * tiny) * 2) by (apply Rmult_le_compat; try lra; apply Rmult_le_pos;
    lra). lra.
Qed.
