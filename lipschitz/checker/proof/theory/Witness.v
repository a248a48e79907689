(** A slope from below, accepted for two points, holds. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Claims Slopes.
Import ListNotations.
Open Scope R_scope.

Lemma real_clamped c x : reals (clampedD c x) = clamped c (reals x).
Proof.
  revert x. induction c as [|[l h] c IH]; intros [|a x]; simpl; auto. f_equal; auto.
  assert (forall p q, real (if at_most p q then q else p) = Rmax (real p) (real q)) as M.
  { intros p q. unfold Rmax. destruct (at_most p q) eqn:E.
    - apply at_most_real in E. destruct (Rle_dec _ _); lra.
    - apply at_most_false in E. destruct (Rle_dec _ _); lra. }
  rewrite <- M. set (b := if at_most a l then l else a). unfold Rmin. destruct (at_most b h) eqn:E.
  - apply at_most_real in E. destruct (Rle_dec _ _); lra.
  - apply at_most_false in E. destruct (Rle_dec _ _); lra.
Qed.
Lemma real_value p x : relu_between p = true -> reals (valueD p x) = value p (reals x).
Proof. intros H. unfold valueD, value. now rewrite real_network, real_clamped, relu_network. Qed.
Lemma real_value_of ps f rest x : forallb relu_between (parts_of ps f) = true ->
  reals (value_ofD ps f rest x) = value_of ps f (reals rest) (reals x).
Proof.
  destruct f; simpl; intros H; both H; [now rewrite real_value|]. both H0.
  now rewrite real_value, (f_plus add Rplus real real_add), real_value.
Qed.
Lemma real_rest ps others : forallb (fun o => relu_between (part_at ps (fst o))) others = true ->
  reals (fold_right (plus add) [] (map (fun o => valueD (part_at ps (fst o)) (snd o)) others)) =
  vector_sum (map (fun o => value (part_at ps (fst o)) (snd o)) (map
      (fun o : nat * list dyadic => (fst o, reals (snd o))) others)).
Proof.
  induction others as [|o others IH]; simpl; auto. intros H. both H.
  now rewrite (f_plus add Rplus real real_add), IH, real_value.
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
  destruct (fraction_in scale (minusD x y)) as [n m] eqn:E. do 9 both H.
  rename H0 into Hr, H1 into Hn, H2 into Ho, H3 into Hx, H4 into Ha, H5 into Hl, H6 into Hs.
  rename H7 into Hw, H8 into Hro.
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
  - rewrite <- real_rest by auto. fold rest. rewrite <- !real_value_of by auto.
    rewrite !real_mul, real_square, real_minus, En in Hr. unfold distance, norm.
    rewrite <- (sqrt_square (real l)) at 1 by auto. rewrite <- sqrt_mult_alt by nra. apply sqrt_le_1_alt.
    apply (Rmult_le_reg_r (real m)); auto. lra.
Qed.
