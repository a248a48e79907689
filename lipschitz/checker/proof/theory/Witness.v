(** A slope from below, accepted for two points, holds. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Centred Claims Slopes.
Import ListNotations.
Open Scope R_scope.

Lemma value_within p b x : within b x -> within (value_ends p b) (value p x).
Proof. intros H. now apply network_within, within_clamped. Qed.
Lemma value_of_within ps f rest b r x : within rest r -> within b x ->
  within (value_of_ends ps f rest b) (value_of ps f r x).
Proof.
  destruct f; simpl; intros R H; [now apply value_within|].
  apply value_within, plus_within; auto. now apply value_within.
Qed.
Lemma point_within x : within (at_point x) (reals x).
Proof. induction x; simpl; auto. split; [lra|auto]. Qed.
Lemma rest_within ps others :
  within (fold_right plus_ends [] (map (fun o => value_ends (part_at ps (fst o)) (at_point (snd o))) others))
    (vector_sum (map (fun o => value (part_at ps (fst o)) (snd o)) (map
      (fun o : nat * list dyadic => (fst o, reals (snd o))) others))).
Proof.
  induction others as [|o others IH]; simpl; auto. apply plus_within; auto. apply value_within, point_within.
Qed.
Lemma least_square_below a b x y : within a x -> within b y -> real (least_square a b) <= square (minus x y).
Proof.
  revert b x y. induction a as [|[l h] a IH]; intros [|[m k] b] x y; try (intros; simpl least_square; rewrite real_zero;
    apply square_nonneg). destruct x as [|c x], y as [|d y]; simpl; try tauto. unfold square, minus. simpl.
  intros [H H'] [G G']. specialize (IH _ _ _ H' G'). unfold square, minus in IH.
  rewrite real_add, real_mul, !real_larger, !real_add, !real_neg.
  rewrite real_zero. set (e := Rmax 0 _).
  assert (0 <= e <= Rabs (c + -1 * d)) as [E F].
  { unfold e. split; [apply Rmax_l|]. apply Rmax_lub; [apply Rabs_pos|]. pose proof (Rle_abs (c + -1 * d)) as P.
    pose proof (Rle_abs (- (c + -1 * d))) as N. rewrite Rabs_Ropp in N. apply Rmax_lub; lra. }
  assert (e * e <= (c + -1 * d) * (c + -1 * d)); [|lra].
  rewrite <- (Rabs_pos_eq ((c + -1 * d) * (c + -1 * d))), Rabs_mult by (apply Rle_0_sqr). now apply Rmult_le_compat.
Qed.
Lemma agree_real moves x y : agreeD moves x y = true -> agree moves (reals x) (reals y).
Proof.
  revert x y. induction moves as [|m moves IH]; intros [|a x] [|b y]; simpl; auto; try discriminate.
  intros H. both H. split; auto. destruct m; auto. right. apply Z.eqb_eq in H.
  assert (real (add a (neg b)) = 0) as E by (unfold real; rewrite H; ring). rewrite real_add, real_neg in E. lra.
Qed.
Lemma fraction_real scale d : positive_scale scale = true ->
  0 < real (snd (fraction_in scale d)) /\
  real (fst (fraction_in scale d)) = square_in scale (reals d) * real (snd (fraction_in scale d)).
Proof.
  revert scale. induction d as [|a d IH]; intros scale Hs; simpl.
  - rewrite real_one, real_zero. lra.
  - destruct (positive_hd _ Hs) as [P Q]. destruct (IH _ Q) as [Hm Hn].
    destruct (fraction_in (tl scale) d) as [n m]. simpl in *. rewrite !real_add, !real_mul, Hn. split.
    + assert (0 < real (hd one scale) * real (hd one scale)) by nra. nra.
    + field. lra.
Qed.
Lemma real_minus u v : reals (minusD u v) = minus (reals u) (reals v).
Proof.
  unfold minusD, minus. rewrite (f_plus add Rplus real real_add), (f_scale mul Rmult real real_mul).
  replace (real (-1, 0)%Z) with (-1) by (unfold real; simpl; ring). reflexivity.
Qed.
Lemma points_sound ps silent f moves scale l x y others :
  check_points ps silent f moves scale l x y others = true -> holds ps (Slope_at_least silent f moves scale l).
Proof.
  unfold check_points. set (rest := fold_right _ _ _). intros H.
  destruct (fraction_in scale (minusD x y)) as [n m] eqn:E. do 7 both H.
  rename H0 into Hr, H1 into Hn, H2 into Ho, H3 into Hx, H4 into Ha, H5 into Hl, H6 into Hs.
  destruct (fraction_real scale (minusD x y) Hs) as [Pm En]. rewrite E, real_minus in *. simpl in *.
  apply real_positive in Hn. apply real_nonnegative in Hl. apply at_most_real in Hr.
  assert (0 < square_in scale (minus (reals x) (reals y))) as Ps by
      (pose proof (square_in_nonneg scale (minus (reals x) (reals y))); nra).
  exists (map (fun o => (fst o, reals (snd o))) others), (reals x), (reals y). repeat split.
  - now apply agree_real.
  - rewrite map_length. now apply Nat.eqb_eq.
  - apply sqrt_lt_R0, Ps.
  - rewrite forallb_forall in Ho. apply Forall_map, Forall_forall. intros o G. simpl. rewrite map_length.
      now apply Nat.eqb_eq, Ho.
  - rewrite map_map. simpl. now apply negb_true_iff.
  - pose proof (rest_within ps others) as R. fold rest in R.
    pose proof (least_square_below _ _ _ _ (value_of_within ps f _ _ _ _ R (point_within x))
      (value_of_within ps f _ _ _ _ R (point_within y))) as L.
    rewrite !real_mul, En in Hr. unfold distance, norm.
    rewrite <- (sqrt_square (real l)) at 1 by auto. rewrite <- sqrt_mult_alt by nra. apply sqrt_le_1_alt.
    apply (Rmult_le_reg_r (real m)); auto. apply (Rmult_le_compat_r (real m)) in L; lra.
Qed.
